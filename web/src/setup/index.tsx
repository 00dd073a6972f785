/** The setup of a surgery's spine. */
import type { VNode } from "preact";
import { useMemo, useState } from "preact/hooks";

import type { ProblemError, Tagged } from "../api/client";
import { Resource, useResource } from "../api/resource";
import type { StoredSpineSetup, Surgery } from "../api/types";
import { Failure } from "../app/failure";
import { href, paths } from "../app/route";
import { draftInitial } from "../radiographs/draft-initial";
import { forgetDraft } from "../radiographs/draft-store";
import { permits } from "../state/session";
import { AxesFields } from "./axes-fields";
import { Conflict } from "./conflict";
import { rebased } from "./differences";
import { formOf, newForm, type SetupForm, setupOf } from "./form";
import { InitialFields } from "./initial-fields";
import { MarkerFields } from "./marker-fields";
import { Rebaseline } from "./rebaseline";
import { Revisions } from "./revisions";
import "./setup.css";
import { saveSetup, useStoredSetup } from "./stored";
import { TargetFields } from "./target-fields";

/** The page of a surgery's setup. */
export function SetupPage({ surgeryId }: { surgeryId: string }): VNode {
  const surgery = useResource<Surgery>(`/v1/surgeries/${encodeURIComponent(surgeryId)}`);
  const { stored, changed, reload } = useStoredSetup(surgeryId);
  return (
    <div class="stack">
      <div class="page-heading">
        <h1>Setup of the spine</h1>
        {surgery.state === "ready" && <a href={href(paths.surgery(surgeryId))}>{surgery.value.reference}</a>}
        <a href={href(paths.radiographs(surgeryId))}>Radiographs</a>
      </div>
      <Resource of={surgery} loading="Loading the surgery">
        {(found) => {
          if (stored.state === "loading") return <p class="loading" role="status">Loading the setup …</p>;
          if (stored.state === "failed") return <Failure problem={stored.problem} />;
          const names = [...new Set(found.stages.map(({ name }) => name))];
          return (
            <div class="setup-columns">
              <Editor surgery={found} stored={stored.stored} changed={changed} reload={reload} />
              <div class="stack">
                <Revisions surgeryId={surgeryId} />
                {stored.stored !== null && (
                  <Rebaseline surgery={found} stages={names} known={stored.stored.value.rebaselines} reload={reload} />
                )}
              </div>
            </div>
          );
        }}
      </Resource>
    </div>
  );
}

interface EditorProps {
  surgery: Surgery;
  stored: Tagged<StoredSpineSetup> | null;
  changed: boolean;
  reload: () => Promise<void>;
}

type Saving =
  | { readonly state: "idle" | "busy" | "saved" }
  | { readonly state: "refused"; readonly problem: ProblemError }
  | { readonly state: "conflict"; readonly theirs: Tagged<StoredSpineSetup> };

function Editor({ surgery, stored, changed, reload }: EditorProps): VNode {
  const start = (): SetupForm => {
    const form = stored === null ? newForm(surgery.spine_axis) : formOf(stored.value.setup);
    return { ...form, radiographs: draftInitial(surgery.id) ?? form.radiographs };
  };
  const [form, setForm] = useState(start);
  const [base, setBase] = useState(stored);
  const [saving, setSaving] = useState<Saving>({ state: "idle" });
  const stages = useMemo(() => [...new Set(surgery.stages.map(({ name }) => name))], [surgery]);
  const { setup, faults } = useMemo(() => setupOf(form), [form]);
  const isOld = changed && saving.state !== "busy" && saving.state !== "saved";
  const mayWrite = permits("correct:write");

  const change = (next: SetupForm): void => {
    setForm(next);
    if (saving.state === "saved" || saving.state === "refused") setSaving({ state: "idle" });
  };
  const save = async (): Promise<void> => {
    if (setup === null) return;
    setSaving({ state: "busy" });
    const result = await saveSetup(surgery.id, setup, base);
    if (result.outcome === "conflict") return setSaving({ state: "conflict", theirs: result.theirs });
    if (result.outcome === "refused") return setSaving({ state: "refused", problem: result.problem });
    if (form.initial === "radiographs") forgetDraft(surgery.id);
    await reload();
    return setSaving({ state: "saved" });
  };
  // after a save, what was read again is what the next save replaces
  if (saving.state === "saved" && stored !== null && stored !== base) {
    setBase(stored);
    setForm(formOf(stored.value.setup));
  }

  const goOn = (theirs: Tagged<StoredSpineSetup>, keepMine: boolean): void => {
    const mine = keepMine && setup !== null ? rebased(base?.value.setup ?? null, setup, theirs.value.setup) : theirs.value.setup;
    setForm(formOf(mine));
    setBase(theirs);
    setSaving({ state: "idle" });
  };

  return (
    <form
      class="stack"
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
    >
      {isOld && (
        <p class="notice notice-warning" role="status">
          The stored setup has changed since this page read it. Saving shows what differs, and overwrites nothing.
        </p>
      )}
      {saving.state === "conflict" && setup !== null && (
        <Conflict
          base={base?.value.setup ?? null}
          mine={setup}
          theirs={saving.theirs.value}
          onTheirs={() => goOn(saving.theirs, false)}
          onBoth={() => goOn(saving.theirs, true)}
        />
      )}
      <AxesFields form={form} faults={faults} change={change} />
      <MarkerFields form={form} surgery={surgery} stages={stages} faults={faults} change={change} />
      <InitialFields form={form} surgery={surgery} faults={faults} change={change} />
      <TargetFields form={form} change={change} />
      <div class="panel row spread setup-save">
        <span class="muted small">
          {base === null ? "No setup is stored yet." : `Replaces revision ${base.value.revision}.`} All spines are computed again.
        </span>
        <div class="row">
          {saving.state === "saved" && base !== null && <span class="badge badge-good" role="status">stored as revision {base.value.revision}</span>}
          {!mayWrite && <span class="small muted">This key lacks the scope correct:write.</span>}
          <button type="submit" class="button button-primary" disabled={setup === null || saving.state === "busy" || saving.state === "conflict" || !mayWrite}>
            {saving.state === "busy" ? "Storing …" : "Store the setup"}
          </button>
        </div>
      </div>
      {saving.state === "refused" && <Failure problem={saving.problem} />}
    </form>
  );
}
