/** The takes of a surgery by stage. */
import type { Flag, Stage, SurgerySummary } from "../api/types";

export interface StageGroup {
  readonly name: string;
  /** Every take, oldest first. */
  readonly takes: readonly Stage[];
  /** The take whose results count: the latest measured one; the latest one while none is measured. */
  readonly counted: Stage;
  readonly latest: Stage;
  /** Whether the latest take is waiting or being measured. */
  readonly active: boolean;
  /** Time of capture, or of storage while that is not known. */
  readonly time: string;
}

/**
 * The stages of a surgery in the order of its summary, which does not depend on the clock. Those that a summary does not
 * have yet come after them, in the order in which their first takes were sent.
 */
export function stageGroups(takes: readonly Stage[], summary: SurgerySummary | null = null): StageGroup[] {
  const places = new Map(summary?.stages.map(({ name }, place) => [name, place]));
  const placeOf = (name: string): number => places.get(name) ?? places.size;
  const byName = new Map<string, Stage[]>();
  for (const take of [...takes].sort(byCreation)) {
    byName.set(take.name, [...(byName.get(take.name) ?? []), take]);
  }
  const ordered = [...byName.entries()].sort(([one], [other]) => placeOf(one) - placeOf(other));
  return ordered.flatMap(([name, sent]) => {
    const own = sent.sort((one, other) => one.take - other.take);
    const latest = own.at(-1);
    if (latest === undefined) return [];
    const counted = own.findLast(({ state }) => state === "succeeded") ?? latest;
    const active = latest.state === "queued" || latest.state === "running";
    return [{ name, takes: own, counted, latest, active, time: counted.captured_at ?? counted.created_at }];
  });
}

/** The flags of a stage: of its images and triads, and of its spine. */
export function flagsOf(group: StageGroup, summary: SurgerySummary | null): Flag[] {
  const spine = summary?.stages.find(({ name }) => name === group.name)?.spine;
  return [...(group.counted.flags ?? []), ...(spine?.flags ?? [])];
}

/** The state of a measurement that has not ended, as a percentage with its step. */
export function progressText(stage: Stage): string {
  if (stage.state === "queued") return "waiting for a worker";
  const percent = `${Math.round(stage.job.progress * 100)}%`;
  return stage.job.step === null ? percent : `${percent} · ${stage.job.step}`;
}

function byCreation(one: Stage, other: Stage): number {
  return one.created_at < other.created_at ? -1 : one.created_at > other.created_at ? 1 : one.take - other.take;
}
