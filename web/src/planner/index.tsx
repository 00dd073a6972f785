/** Planner: what a rig and a marker will achieve before they are built, for one design or two. */
import type { VNode } from "preact";
import { useEffect, useState } from "preact/hooks";

import { Failure } from "../app/failure";
import { paths } from "../app/route";
import { CeilingForm } from "./ceiling-form";
import { addressOf, type Design, designsOf, disparityQueryOf, faultsOf, queryOf } from "./design";
import { DesignForm } from "./design-form";
import "./planner.css";
import { Disparities, type Planned, Results } from "./results";
import { type PlanState, usePlan } from "./use-plan";

/** The page of the planner. */
export function PlannerPage(): VNode {
  const [{ first, second }, setDesigns] = useState(() => designsOf(location.hash));
  const address = addressOf(first, second);
  useEffect(() => {
    history.replaceState(history.state, "", `#${paths.planner}${address === "" ? "" : `?${address}`}`);
  }, [address]);
  useEffect(() => {
    const read = (): void => setDesigns(designsOf(location.hash));
    addEventListener("hashchange", read);
    return () => removeEventListener("hashchange", read);
  }, []);
  const faults = { A: faultsOf(first), B: second === null ? {} : faultsOf(second) };
  const isSound = { A: Object.keys(faults.A).length === 0, B: second !== null && Object.keys(faults.B).length === 0 };
  const a = usePlan(isSound.A ? queryOf(first) : null, isSound.A ? disparityQueryOf(first) : null);
  const b = usePlan(
    isSound.B && second !== null ? queryOf(second) : null,
    isSound.B && second !== null ? disparityQueryOf(second) : null,
  );
  const rig = a.state === "ready" ? a.accuracy.rig : null;
  return (
    <div class="stack planner">
      <div class="page-heading">
        <h1>Planner</h1>
        <span class="muted">Standard deviations from the normal equations; nothing is measured or stored.</span>
        <ShareButton />
      </div>
      <div class="planner-columns">
        <div class="stack no-print">
          <section class="panel stack" aria-labelledby="design-a">
            <h2 id="design-a">Design A</h2>
            <DesignForm name="A" design={first} faults={faults.A} change={(design) => setDesigns({ first: design, second })} />
          </section>
          {second === null ? (
            <section class="panel stack" aria-labelledby="compare">
              <h2 id="compare">Compare with</h2>
              <CeilingForm design={first} rig={rig} onPlan={(design) => setDesigns({ first, second: design })} />
              <div class="row">
                <button type="button" class="button" onClick={() => setDesigns({ first, second: first })}>A copy of A to change</button>
              </div>
            </section>
          ) : (
            <section class="panel stack" aria-labelledby="design-b">
              <header>
                <h2 id="design-b">Design B</h2>
                <button type="button" class="button button-small" onClick={() => setDesigns({ first, second: null })}>Remove B</button>
              </header>
              <DesignForm name="B" design={second} faults={faults.B} change={(design: Design) => setDesigns({ first, second: design })} />
            </section>
          )}
        </div>
        <Outcome a={a} b={second === null ? null : b} isSound={isSound.A && (second === null || isSound.B)} />
      </div>
    </div>
  );
}

/** The results, or what keeps them from being there. */
function Outcome({ a, b, isSound }: { a: PlanState; b: PlanState | null; isSound: boolean }): VNode {
  const states = [
    ["A", a],
    ["B", b],
  ] as const;
  const ready = states.flatMap(([name, state]) => (state?.state === "ready" ? [{ name, state }] : []));
  const planned: Planned[] = ready.map(({ name, state }) => ({ name, plan: state.accuracy }));
  const isStale = ready.some(({ state }) => state.stale);
  return (
    <div class="stack" aria-live="polite" aria-busy={isStale}>
      {!isSound && <p class="notice">Correct the marked fields; the figures follow at once.</p>}
      {states.map(([name, state]) =>
        state?.state === "failed" ? (
          <div key={name}>
            <h2>Design {name}</h2>
            <Failure problem={state.problem} />
          </div>
        ) : null,
      )}
      {planned.length > 0 ? (
        <div class={isStale ? "stack planner-stale" : "stack"}>
          <Results planned={planned} />
          <Disparities plans={ready.map(({ name, state }) => ({ name, plan: state.disparity }))} />
        </div>
      ) : (
        isSound && a.state === "none" && <p class="loading" role="status">Planning …</p>
      )}
    </div>
  );
}

/** Copies the address, which contains the designs. */
function ShareButton(): VNode {
  const [copied, setCopied] = useState(false);
  const copy = async (): Promise<void> => {
    try {
      await navigator.clipboard.writeText(location.href);
      setCopied(true);
    } catch {
      setCopied(false); // without permission the address bar has the same text
    }
  };
  return (
    <button type="button" class="button button-small no-print" onClick={() => void copy()}>
      {copied ? "Address copied" : "Copy the address of this plan"}
    </button>
  );
}
