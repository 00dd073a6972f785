/** The takes and revisions of a stage: who made them, when, what was changed, and how they differ. */
import type { VNode } from "preact";

import type { Revision, Stage } from "../api/types";
import { Quantity } from "../format/quantity";
import { dayAndTime } from "../format/time";
import { StateMark } from "../surgeries/state-mark";
import type { Comparison, TriadDifference } from "./comparison";

interface TakesPanelProps {
  takes: readonly Stage[];
  counted: Stage | null;
  shown: Stage;
  compared: number | null;
  comparison: Comparison | null;
  /** Whether another take may be shown now. */
  canShow: boolean;
  onShow: (take: number) => void;
  onCompare: (take: number | null) => void;
}

/** The list of takes, and the comparison with one of them. */
export function TakesPanel(props: TakesPanelProps): VNode {
  const { takes, shown, compared, comparison, canShow, onShow, onCompare } = props;
  return (
    <div class="stack">
      <div class="scroll-x">
        <table>
          <caption>Takes and revisions, the latest first; all are kept.</caption>
          <thead>
            <tr>
              <th scope="col">Take</th>
              <th scope="col">State</th>
              <th scope="col">Made</th>
              <th scope="col">By</th>
              <th scope="col">What</th>
              <th scope="col">
                <span class="visually-hidden">Actions</span>
              </th>
            </tr>
          </thead>
          <tbody>
            {takes.map((take) => (
              <tr class={take.take === shown.take ? "is-selected" : ""}>
                <th scope="row">
                  {take.take}
                  <span class="muted">{marks(take, props)}</span>
                </th>
                <td>
                  <StateMark state={take.state} />
                </td>
                <td>{dayAndTime(take.revision?.at ?? take.created_at)}</td>
                <td>{take.revision?.by ?? <span class="muted">the images as sent</span>}</td>
                <td>{take.revision == null ? "images of its own" : describedRevision(take.revision)}</td>
                <td>
                  <span class="row">
                    <button
                      type="button"
                      class="button button-small"
                      disabled={!canShow || take.state !== "succeeded" || take.take === shown.take}
                      onClick={() => onShow(take.take)}
                    >
                      Show<span class="visually-hidden"> take {take.take}</span>
                    </button>
                    <button
                      type="button"
                      class="button button-small"
                      aria-pressed={take.take === compared}
                      disabled={take.state !== "succeeded" || take.take === shown.take || !sameImages(take, shown)}
                      onClick={() => onCompare(take.take === compared ? null : take.take)}
                    >
                      Compare<span class="visually-hidden"> with take {take.take}</span>
                    </button>
                  </span>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {compared !== null && comparison !== null && <Differences then={compared} now={shown.take} comparison={comparison} />}
    </div>
  );
}

function marks(take: Stage, { counted, shown }: TakesPanelProps): string {
  const all = [take.take === counted?.take ? "counts" : "", take.take === shown.take ? "shown" : ""].filter(Boolean);
  return all.length === 0 ? "" : ` (${all.join(", ")})`;
}

/** Whether two takes are of the same images. */
export function sameImages(one: Stage, other: Stage): boolean {
  return one.images.left.sha256 === other.images.left.sha256 && one.images.right.sha256 === other.images.right.sha256;
}

function Differences({ then, now, comparison }: { then: number; now: number; comparison: Comparison }): VNode {
  return (
    <div class="scroll-x">
      <table>
        <caption>
          Take {now} compared with take {then}, whose ball centres are drawn as squares over the images.
        </caption>
        <thead>
          <tr>
            <th scope="col">Triad</th>
            <th scope="col">Label</th>
            <th scope="col" class="number">P moved</th>
            <th scope="col" class="number">Largest in the left image</th>
            <th scope="col" class="number">Largest in the right image</th>
          </tr>
        </thead>
        <tbody>
          {comparison.triads.map((triad) => (
            <tr>
              <th scope="row">{triad.name}</th>
              <td>{labelText(triad, then, now)}</td>
              <td class="number">
                <Quantity value={triad.movedMm} unit="mm" digits={2} reason={absence(triad, then, now)} />
              </td>
              <td class="number">
                <Quantity value={triad.movedPx.left} unit="px" digits={2} reason={absence(triad, then, now)} />
              </td>
              <td class="number">
                <Quantity value={triad.movedPx.right} unit="px" digits={2} reason={absence(triad, then, now)} />
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function absence(triad: TriadDifference, then: number, now: number): string {
  if (triad.in === "both") return "no ball or pose in one of the takes";
  return `only take ${triad.in === "then" ? then : now} has it`;
}

function labelText(triad: TriadDifference, then: number, now: number): string {
  if (triad.in === "then") return `only in take ${then}`;
  if (triad.in === "now") return `only in take ${now}`;
  const [before, after] = [triad.labelThen ?? "no label", triad.labelNow ?? "no label"];
  return before === after ? after : `${before} → ${after}`;
}

/** What a revision changed, in a sentence. */
export function describedRevision(revision: Revision): string {
  const { changes, of_take } = revision;
  if (changes.kind === "measure") {
    const names = Object.keys(changes.parameters ?? {});
    const templates = changes.templates == null ? [] : [`templates ${changes.templates}`];
    const what = [...names, ...templates].join(", ");
    return `take ${of_take} measured again${what === "" ? "" : ` with other ${what}`}`;
  }
  if (changes.kind === "relabel") return `labels of take ${of_take} found again, because a stage that decides on them was revised`;
  const parts = [
    numberOf(changes.labels?.length ?? 0, "label"),
    numberOf(changes.removed?.length ?? 0, "triad removed", "triads removed"),
    numberOf(changes.centres?.length ?? 0, "ball centre"),
  ].filter((part) => part !== null);
  return `correction of take ${of_take}: ${parts.join(", ")}`;
}

function numberOf(count: number, one: string, many = `${one}s`): string | null {
  return count === 0 ? null : `${count} ${count === 1 ? one : many}`;
}
