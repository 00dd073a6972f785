/** The form of a new surgery. */
import type { TargetedEvent, VNode } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

import { ProblemError, send } from "../api/client";
import type { NewSurgery, Surgery } from "../api/types";
import { Failure } from "../app/failure";
import { navigate, paths } from "../app/route";
import { referenceFor, vertebraeOf } from "./new-surgery";

/** Ask for what is known of a surgery before its first stage, and add it. */
export function NewSurgeryForm(): VNode {
  const [reference, setReference] = useState("");
  const [markers, setMarkers] = useState("");
  const [chosen, setChosen] = useState("");
  const [axis, setAxis] = useState<"auto" | "x" | "y">("auto");
  const [extra, setExtra] = useState("");
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const [busy, setBusy] = useState(false);
  const field = useRef<HTMLInputElement>(null);
  useEffect(() => field.current?.focus(), []);

  const vertebrae = vertebraeOf(markers);
  const referenceVertebra = referenceFor(vertebrae, chosen);

  const add = async (): Promise<void> => {
    setBusy(true);
    setProblem(null);
    const body: NewSurgery = {
      reference: reference.trim(),
      vertebrae,
      reference_vertebra: referenceVertebra,
      spine_axis: axis,
      extra_levels: vertebraeOf(extra),
    };
    try {
      navigate(paths.surgery((await send<Surgery>("POST", "/v1/surgeries", body)).id));
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      setProblem(error);
    } finally {
      setBusy(false);
    }
  };

  const submit = (event: TargetedEvent<HTMLFormElement, SubmitEvent>): void => {
    event.preventDefault();
    void add();
  };

  return (
    <form class="panel stack new-surgery" aria-labelledby="new-surgery" onSubmit={submit}>
      <h2 id="new-surgery">New surgery</h2>
      <div class="new-surgery-fields">
        <div class="field">
          <label for="reference">Case number</label>
          <input
            id="reference"
            ref={field}
            required
            maxLength={64}
            autocomplete="off"
            value={reference}
            aria-describedby="reference-hint"
            onInput={(event) => setReference(event.currentTarget.value)}
          />
          <p class="hint" id="reference-hint">
            The hospital's own number, never a name.
          </p>
        </div>
        <div class="field">
          <label for="markers">Vertebrae with a marker</label>
          <input
            id="markers"
            required
            autocomplete="off"
            placeholder="L1 T11 T9 T7"
            value={markers}
            aria-describedby="markers-hint"
            onInput={(event) => setMarkers(event.currentTarget.value)}
          />
          <p class="hint" id="markers-hint">
            In order of increasing coordinate along the axis, downwards or upwards.
          </p>
        </div>
        <div class="field">
          <label for="reference-vertebra">Vertebra of reference</label>
          <select
            id="reference-vertebra"
            value={referenceVertebra}
            disabled={vertebrae.length === 0}
            onChange={(event) => setChosen(event.currentTarget.value)}
          >
            {vertebrae.map((name) => (
              <option value={name}>{name}</option>
            ))}
          </select>
          <p class="hint">Motion is given in its frame.</p>
        </div>
        <div class="field">
          <label for="axis">Axis along the spine</label>
          <select id="axis" value={axis} onChange={(event) => setAxis(event.currentTarget.value as "auto" | "x" | "y")}>
            <option value="auto">from the images</option>
            <option value="x">x of object space</option>
            <option value="y">y of object space</option>
          </select>
        </div>
        <div class="field">
          <label for="extra">Additional levels</label>
          <input
            id="extra"
            autocomplete="off"
            placeholder="none"
            value={extra}
            aria-describedby="extra-hint"
            onInput={(event) => setExtra(event.currentTarget.value)}
          />
          <p class="hint" id="extra-hint">
            Vertebrae that this spine has besides the usual ones: T13, L6.
          </p>
        </div>
      </div>
      {problem !== null && <Failure problem={problem} />}
      <p>
        <button class="button button-primary" disabled={busy}>
          {busy ? "Adding …" : "Add the surgery"}
        </button>
      </p>
    </form>
  );
}
