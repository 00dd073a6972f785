/** A marker that was clamped again while the spine did not move. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { ProblemError, send } from "../api/client";
import { refresh } from "../api/resource";
import type { NewRebaseline, StoredRebaseline, Surgery } from "../api/types";
import { Failure } from "../app/failure";
import { dayAndTime } from "../format/time";
import { permits } from "../state/session";
import { setupPath } from "./stored";

interface RebaselineProps {
  surgery: Surgery;
  stages: readonly string[];
  known: readonly StoredRebaseline[];
  reload: () => Promise<void>;
}

/** The markers that were clamped again, and the form of another one. */
export function Rebaseline({ surgery, stages, known, reload }: RebaselineProps): VNode {
  const movable = surgery.vertebrae.filter((name) => name !== surgery.reference_vertebra);
  const [vertebra, setVertebra] = useState(movable[0] ?? "");
  const [before, setBefore] = useState(stages[0] ?? "");
  const later = stages.slice(stages.indexOf(before) + 1);
  const [chosen, setChosen] = useState("");
  const after = later.includes(chosen) ? chosen : (later[0] ?? "");
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const add = async (): Promise<void> => {
    setProblem(null);
    try {
      const body: NewRebaseline = { vertebra, before, after };
      await send<StoredRebaseline>("POST", `${setupPath(surgery.id)}/rebaselines`, body);
      refresh(`/v1/surgeries/${encodeURIComponent(surgery.id)}`);
      await reload();
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      setProblem(error);
    }
  };
  return (
    <section class="panel stack" aria-labelledby="rebaseline-title">
      <h2 id="rebaseline-title">Marker clamped again</h2>
      <p class="muted small">The marker got a new place on its vertebra, and the spine did not move between these two stages.</p>
      {known.length > 0 && (
        <ul class="small">
          {known.map((item) => (
            <li>{`${item.vertebra}: between ${item.before} and ${item.after}, stated ${dayAndTime(item.created_at)}`}</li>
          ))}
        </ul>
      )}
      {stages.length < 2 ? (
        <p class="empty">There must be two stages.</p>
      ) : (
        <form
          class="setup-triple"
          onSubmit={(event) => {
            event.preventDefault();
            void add();
          }}
        >
          <Choice id="rebaseline-vertebra" label="Vertebra" values={movable} value={vertebra} onChange={setVertebra} />
          <Choice id="rebaseline-before" label="Last stage before" values={stages.slice(0, -1)} value={before} onChange={setBefore} />
          <Choice id="rebaseline-after" label="First stage after" values={later} value={after} onChange={setChosen} />
          <button type="submit" class="button" disabled={after === "" || vertebra === "" || !permits("correct:write")}>State it</button>
        </form>
      )}
      {problem !== null && <Failure problem={problem} />}
    </section>
  );
}

interface ChoiceProps {
  id: string;
  label: string;
  values: readonly string[];
  value: string;
  onChange: (value: string) => void;
}

function Choice({ id, label, values, value, onChange }: ChoiceProps): VNode {
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <select id={id} value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        {values.map((each) => <option value={each}>{each}</option>)}
      </select>
    </div>
  );
}
