/** Points that the cameras see too: triads by their vertebra, or places in object space. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { Action } from "./editor";
import type { CommonDraft } from "./landmarks";

interface CommonProps {
  common: readonly CommonDraft[];
  marked: readonly string[];
  dispatch: (action: Action) => void;
}

/** The list of common points, and the form of another one. */
export function CommonPoints({ common, marked, dispatch }: CommonProps): VNode {
  const [kind, setKind] = useState<"triad" | "object">("triad");
  const [name, setName] = useState("");
  const [triad, setTriad] = useState("");
  const [place, setPlace] = useState(["", "", "", "0.5"]);
  const free = marked.filter((each) => !common.some((point) => point.place.kind === "triad" && point.place.triad === each));
  const chosen = free.includes(triad) ? triad : (free[0] ?? "");
  const wanted = (kind === "triad" && name.trim() === "" ? `triad ${chosen}` : name.trim()).slice(0, 40);
  const numbers = place.map((text) => (text.trim() === "" ? Number.NaN : Number(text)));
  const isComplete =
    wanted !== "" &&
    !common.some((point) => point.name === wanted) &&
    (kind === "triad" ? chosen !== "" : numbers.every(Number.isFinite) && (numbers[3] ?? -1) >= 0);

  const add = (): void => {
    if (!isComplete) return;
    const [x = 0, y = 0, z = 0, sdMm = 0] = numbers;
    const where: CommonDraft["place"] = kind === "triad" ? { kind, triad: chosen } : { kind, mm: [x, y, z], sdMm };
    dispatch({ type: "add-common", common: { name: wanted, place: where, pa: null, lateral: null } });
    setName("");
  };

  return (
    <section class="panel stack" aria-labelledby="common-title">
      <header>
        <h2 id="common-title">Common points</h2>
        <span class="muted small">at least three, not on one line</span>
      </header>
      {common.length > 0 && (
        <ul class="stack fault-list">
          {common.map((point) => (
            <li class="row spread" key={point.name}>
              <span>
                <strong>{point.name}</strong>{" "}
                <span class="muted small">
                  {point.place.kind === "triad"
                    ? `point P of the triad of ${point.place.triad}`
                    : `object space (${point.place.mm.join(", ")}) ± ${point.place.sdMm} mm`}
                </span>
              </span>
              <button
                type="button"
                class="button button-small"
                aria-label={`Remove common point ${point.name}`}
                onClick={() => dispatch({ type: "remove-common", name: point.name })}
              >
                Remove
              </button>
            </li>
          ))}
        </ul>
      )}
      <form
        class="stack"
        onSubmit={(event) => {
          event.preventDefault();
          add();
        }}
      >
        <div class="common-row">
          <div class="field">
            <label for="common-kind">Seen as</label>
            <select id="common-kind" value={kind} onChange={(event) => setKind(event.currentTarget.value as "triad" | "object")}>
              <option value="triad">a triad</option>
              <option value="object">a place</option>
            </select>
          </div>
          <div class="field">
            {kind === "triad" ? (
              <>
                <label for="common-triad">Triad of</label>
                <select id="common-triad" value={chosen} onChange={(event) => setTriad(event.currentTarget.value)}>
                  {free.map((each) => <option value={each}>{each}</option>)}
                </select>
              </>
            ) : (
              <>
                <label for="common-name">Name</label>
                <input id="common-name" maxLength={40} value={name} onInput={(event) => setName(event.currentTarget.value)} />
              </>
            )}
          </div>
          <button type="submit" class="button" disabled={!isComplete}>Add</button>
        </div>
        {kind === "object" && (
          <div class="row">
            {["x", "y", "z", "sd"].map((axis, index) => (
              <div class="field coordinate">
                <label for={`common-${axis}`}>{axis}, mm</label>
                <input
                  id={`common-${axis}`}
                  inputMode="decimal"
                  size={6}
                  value={place[index]}
                  onInput={(event) => setPlace(place.map((text, i) => (i === index ? event.currentTarget.value : text)))}
                />
              </div>
            ))}
          </div>
        )}
      </form>
    </section>
  );
}
