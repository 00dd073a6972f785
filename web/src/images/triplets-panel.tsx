/** Candidate triads: those chosen, and why each of the others was rejected. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { CandidateTriad, Explanation } from "../api/types";
import { fixed } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { TRIAD_REASONS, triadReason } from "./reasons";
import { type Scene, triadName } from "./scene";

const CHOSEN = "chosen";
const REJECTED = "rejected";
const PAGE = 40;

interface TripletsPanelProps {
  explanation: Explanation | null;
  scene: Scene;
  /** Place in the list of the candidate that is drawn over the images. */
  shown: number | null;
  onShow: (index: number | null) => void;
  /** Move both images to a candidate. */
  onLook: (index: number) => void;
}

/** The candidate triads as a list that can be filtered. */
export function TripletsPanel({ explanation, scene, shown, onShow, onLook }: TripletsPanelProps): VNode {
  const [filter, setFilter] = useState<string>(REJECTED);
  const [count, setCount] = useState(PAGE);
  if (explanation === null) {
    return <p class="empty">This take was measured by a version that did not keep its candidates. Measure it again to see them.</p>;
  }
  const all = explanation.triads.map((triad, index) => ({ triad, index }));
  const listed = all.filter(({ triad }) => matches(triad, filter));
  return (
    <div class="stack">
      <div class="row spread">
        <label class="field triplet-filter">
          <span class="label">Show</span>
          <select
            aria-label="Which candidate triads"
            value={filter}
            onChange={(event) => {
              setFilter(event.currentTarget.value);
              setCount(PAGE);
            }}
          >
            <option value={REJECTED}>All rejected ({all.filter(({ triad }) => matches(triad, REJECTED)).length})</option>
            <option value={CHOSEN}>Chosen ({all.filter(({ triad }) => matches(triad, CHOSEN)).length})</option>
            {Object.entries(TRIAD_REASONS).map(([reason, text]) => {
              const number = all.filter(({ triad }) => triad.reason === reason).length;
              return number === 0 ? null : (
                <option value={reason}>
                  Rejected: {text.title.toLowerCase()} ({number})
                </option>
              );
            })}
          </select>
        </label>
        <p class="muted small">
          Method {explanation.method}. The pointer or the keyboard on a row draws it over both images; H1 to H5 are the
          heuristics of the thesis (section 5.6).
        </p>
      </div>
      <div class="scroll-x">
        <table class="triplets">
          <caption>
            {listed.length} candidate triads, the likeliest first
            {explanation.triads_left_out > 0 && `; ${explanation.triads_left_out} more are not kept`}.
          </caption>
          <thead>
            <tr>
              <th scope="col">Candidate</th>
              <th scope="col">Rejected because</th>
              <th scope="col">Heuristic</th>
              <th scope="col" class="number">Error of distances</th>
              <th scope="col" class="number">Log-odds</th>
            </tr>
          </thead>
          <tbody>
            {listed.slice(0, count).map(({ triad, index }) => (
              <tr
                class={index === shown ? "is-selected" : ""}
                onPointerEnter={() => onShow(index)}
                onPointerLeave={() => onShow(null)}
              >
                <th scope="row">
                  <button
                    type="button"
                    class="link-button"
                    onFocus={() => onShow(index)}
                    onBlur={() => onShow(null)}
                    onClick={() => onLook(index)}
                  >
                    {nameOf(triad, index, scene)}
                  </button>
                </th>
                <td>{reasonOf(triad, explanation, scene)}</td>
                <td>{triad.heuristic ?? <span class="muted">none</span>}</td>
                <td class="number">
                  <Quantity value={triad.error_mm} unit="mm" digits={2} />
                </td>
                <td class="number">
                  {triad.log_odds === null ? <Quantity value={null} unit="" reason="rejected before they were computed" /> : fixed(triad.log_odds, 1)}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {listed.length === 0 && <p class="empty">No candidate triad of this kind.</p>}
      {listed.length > count && (
        <button type="button" class="button" onClick={() => setCount(count + PAGE)}>
          Show {Math.min(PAGE, listed.length - count)} more
        </button>
      )}
    </div>
  );
}

function matches(triad: CandidateTriad, filter: string): boolean {
  if (filter === CHOSEN) return triad.reason === null;
  return filter === REJECTED ? triad.reason !== null : triad.reason === filter;
}

function nameOf(candidate: CandidateTriad, index: number, scene: Scene): string {
  const triad = candidate.triad === null ? undefined : scene.triads[candidate.triad];
  return triad === undefined ? `Candidate ${index + 1}` : triadName(triad);
}

function reasonOf(candidate: CandidateTriad, explanation: Explanation, scene: Scene): VNode {
  if (candidate.reason === null) return <span class="badge badge-good">chosen</span>;
  const { title, text } = triadReason(candidate.reason);
  const rival = candidate.rival === null ? undefined : explanation.triads[candidate.rival];
  return (
    <>
      <strong>{title}</strong>: {text}
      {rival !== undefined && candidate.rival !== null && ` (${nameOf(rival, candidate.rival, scene)})`}
    </>
  );
}
