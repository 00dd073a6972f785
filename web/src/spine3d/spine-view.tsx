/** The spine in three dimensions, with controls, legend and the selected vertebra. */
import { useSignal } from "@preact/signals";
import type { VNode } from "preact";
import { useEffect, useId, useMemo, useRef } from "preact/hooks";

import type { StageSpine, SurgerySummary } from "../api/types";
import { selectedVertebra } from "../state/selection";
import type { Palette } from "./appearance";
import { between, type Body, bodiesOf, reachesOf, gapsOf, plannedBodies } from "./bodies";
import { SpineCanvas } from "./canvas";
import { contentOf, type Switches } from "./content";
import { ALL_STAGES, Controls, type Settings } from "./controls";
import { Details } from "./details";
import type { Command } from "./gestures";
import { legendOf } from "./legend";
import { Legend } from "./legend-list";
import { Overlay } from "./overlay";
import { neighbour, pick } from "./picking";
import { Player } from "./player";
import { NO_TRANSFORM, triadsBetween, triadsOf } from "./triads";
import { basisOf, fit, type NamedView, namedView, range, type Screen, type View, VIEWS } from "./views";
import { describe } from "./words";

interface SpineViewProps {
  summary: SurgerySummary;
  spine: StageSpine;
}

const SWITCHES: Switches = { shapes: true, vectors: false, triads: false, line: true, regions: 0 };
const PLAN_GAP_MM = 30;

export function SpineView({ summary, spine }: SpineViewProps): VNode {
  const id = useId();
  const stages = useMemo(() => summary.stages.flatMap((stage) => (stage.spine ? [stage.spine] : [])), [summary]);
  const settings = useSignal<Settings>({
    switches: SWITCHES,
    compared: spine.baseline.name === spine.stage ? null : spine.baseline.name,
    plan: "over",
  });
  const view = useSignal<View | null>(null);
  const screen = useSignal<Screen>({ width: 0, height: 0 });
  const palette = useSignal<Palette>({});
  const fraction = useSignal(1);
  const { switches, plan: planMode } = settings.value;
  const chosen = settings.value.compared;
  const isAll = chosen === ALL_STAGES;
  const compared = stages.find(({ stage }) => stage === chosen && stage !== spine.stage) ?? null;

  const bodies = useMemo(() => bodiesOf(spine), [spine]);
  const before = useMemo(() => (compared ? bodiesOf(compared) : []), [compared]);
  const target = summary.setup?.setup.target ?? null;
  const planned = useMemo(() => (target ? plannedBodies(target, spine) : []), [target, spine]);
  const plan = planMode === "hidden" ? [] : planned;
  const all = useMemo(() => (isAll ? stages.map(bodiesOf) : []), [isAll, stages]);
  const triads = useMemo(() => triadsAt(summary, spine), [summary, spine]);
  const triadsBefore = useMemo(() => (compared ? (triadsAt(summary, compared) ?? []) : []), [summary, compared]);
  const at = compared ? fraction.value : 1;
  const now = useMemo(() => between(before, bodies, at), [before, bodies, at]);
  const selected = selectedVertebra.value;

  const content = useMemo(
    () =>
      contentOf({
        now: isAll ? [] : now,
        before,
        plan,
        stages: all,
        triads: triadsBetween(triadsBefore, triads ?? [], at),
        selected,
        switches,
        palette: palette.value,
      }),
    [now, before, plan, all, isAll, triads, triadsBefore, at, selected, switches, palette.value],
  );

  const shown = useMemo(() => [...bodies, ...before, ...plan, ...all.flat()], [bodies, before, plan, all]);
  const isBeside = planMode === "beside" && plan.length > 0;
  const shift = isBeside && view.value ? shiftOf(bodies, view.value) : 0;
  const show = (direction: Pick<View, "azimuth" | "elevation">): void => {
    const margin = switches.vectors || switches.triads ? 20 : 0;
    const beside = isBeside ? shiftOf(bodies, direction) : 0;
    view.value = fit(direction, reachesOf(shown, margin), screen.value, beside) ?? view.value;
  };
  const look = (name: NamedView): void => show(VIEWS[name]);
  useFirstView(screen.value, () => view.value === null && look("free"));
  useEffect(() => {
    if (view.value !== null) show(view.value);
  }, [planMode, isAll]);
  useEffect(() => {
    fraction.value = 1;
  }, [spine.stage, chosen]);

  const onCommand = (command: Command): void => {
    const levels = bodies.map((body) => body.level);
    if (command === "fit") show(view.value ?? VIEWS.free);
    else if (command === "clear") selectedVertebra.value = null;
    else if (command === "above" || command === "below") {
      selectedVertebra.value = neighbour(levels, selected, command === "below" ? 1 : -1);
    } else look(command);
  };
  const onPick = (x: number, y: number): void => {
    if (view.value === null) return;
    selectedVertebra.value = pick(now, view.value, screen.value, x, y)?.level ?? null;
  };

  const gaps = useMemo(() => gapsOf(spine), [spine]);
  const triadsReason = triads === null ? NO_TRANSFORM : null;
  const text = describe({
    spine,
    before: compared?.stage ?? null,
    hasPlan: plan.length > 0,
    stages: all.length,
    selected,
  });
  const names = stages.map(({ stage }) => stage);
  return (
    <div class="spine-view">
      <Controls
        id={id}
        settings={settings.value}
        stage={spine.stage}
        stages={names}
        hasPlan={planned.length > 0}
        triadsReason={triadsReason}
        current={view.value && namedView(view.value)}
        onChange={(change) => (settings.value = { ...settings.value, ...change })}
        onView={look}
        onFit={() => show(view.value ?? VIEWS.free)}
      />
      <div class="spine-main">
        <SpineCanvas
          content={content}
          view={view}
          screen={screen}
          palette={palette}
          planShiftMm={shift}
          label={text}
          onCommand={onCommand}
          onPick={onPick}
        >
          <Overlay
            view={view}
            screen={screen}
            bodies={isAll ? bodies : now}
            gaps={gaps}
            shown={shown}
            planShiftMm={shift}
            selected={selected}
            onSelect={(level) => (selectedVertebra.value = level)}
          />
        </SpineCanvas>
        <Details spine={spine} id={id} />
      </div>
      {compared && <Player id={id} from={compared.stage} to={spine.stage} fraction={fraction} key={compared.stage} />}
      <Legend
        entries={legendOf({
          statuses: new Set(isAll ? [] : bodies.map((body) => body.status)),
          hasGaps: gaps.length > 0,
          before: compared?.stage ?? null,
          plan: plan.length > 0,
          all: isAll ? names : [],
          vectors: switches.vectors,
          triads: switches.triads && triadsReason === null,
          regions: isAll ? 0 : switches.regions,
        })}
      />
    </div>
  );
}

function triadsAt(summary: SurgerySummary, spine: StageSpine): ReturnType<typeof triadsOf> {
  const stage = summary.stages.find(({ name }) => name === spine.stage);
  return triadsOf(spine, stage?.triads ?? []);
}

/** How far to the right on the screen the plan is drawn beside the spine, mm. */
function shiftOf(bodies: readonly Body[], view: Pick<View, "azimuth" | "elevation">): number {
  const { low, high } = range(reachesOf(bodies), basisOf(view).right);
  return high - low + PLAN_GAP_MM;
}

/** Look at the spine as soon as the size of the screen is known. */
function useFirstView(screen: Screen, begin: () => void): void {
  const isBegun = useRef(false);
  useEffect(() => {
    if (isBegun.current || screen.width === 0) return;
    isBegun.current = true;
    begin();
  }, [screen.width]);
}
