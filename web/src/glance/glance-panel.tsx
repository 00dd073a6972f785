/** The panel that is read from three metres: the newest values, and how far they can be trusted. */
import type { VNode } from "preact";
import { useRef } from "preact/hooks";

import type { MeasureValue, SurgerySummary } from "../api/types";
import { href, paths } from "../app/route";
import { SeverityMark } from "../format/flag-list";
import { flagName, severity, worst } from "../format/flags";
import { DASH, fixed, interval, signed, withUnit } from "../format/numbers";
import { StatusMark } from "../format/status-mark";
import { age, duration } from "../format/time";
import { connection } from "../state/connection";
import { now } from "../state/now";
import { progressText, type StageGroup } from "../timeline/stages";
import "./glance.css";
import { type Glance, glanceOf } from "./model";

/** After this time without a new stage its age is marked. */
const OLD_S = 3600;

interface GlancePanelProps {
  summary: SurgerySummary;
  groups: readonly StageGroup[];
  /** Whether the newest state of the service is not known. */
  stale: boolean;
}

/** The newest values of a surgery in large letters. */
export function GlancePanel({ summary, groups, stale }: GlancePanelProps): VNode {
  const panel = useRef<HTMLElement>(null);
  const shown = glanceOf(summary, groups);
  const lost = stale || connection.value === "lost";
  const none = shown.stage === null ? "no stage with a spine" : "no curve in the baseline";
  return (
    <section ref={panel} class={`panel glance${lost ? " glance-lost" : ""}`} aria-labelledby="glance-heading">
      <header>
        <h2 id="glance-heading">
          Now{shown.stage === null ? "" : `: ${shown.stage.name}`}
          {lost && <span class="glance-warning"> not up to date</span>}
        </h2>
        <button type="button" class="button button-small no-print" onClick={() => void toggleFullScreen(panel.current)}>
          Full screen
        </button>
      </header>
      <Behind shown={shown} surgeryId={summary.surgery_id} setUp={summary.setup !== null} />
      <div class="glance-values">
        <Value title="Cobb angle" of={curveText(shown)} value={shown.cobb} sign="+ convex to the right" none={none} />
        <Value
          title={`Cobb since ${shown.baseline ?? "baseline"}`}
          of={curveText(shown)}
          value={shown.cobbChange}
          sign="+ convex to the right"
          none={noChange(shown)}
          change
        />
        <Value
          title="Apical rotation"
          of={shown.curve?.apex ?? ""}
          value={shown.rotation}
          sign="axial, + anterior turns left"
          none={none}
        />
        <Value
          title={`Rotation since ${shown.baseline ?? "baseline"}`}
          of={shown.curve?.apex ?? ""}
          value={shown.rotationChange}
          sign="axial, + anterior turns left"
          none={noChange(shown)}
          change
        />
        <State shown={shown} />
      </div>
    </section>
  );
}

function Behind({ shown, surgeryId, setUp }: { shown: Glance; surgeryId: string; setUp: boolean }): VNode | null {
  if (shown.behind === null) return null;
  const active = shown.newest?.active ?? false;
  const failed = shown.newest?.latest.state === "failed";
  return (
    <div class={`notice glance-behind ${active ? "" : failed ? "notice-error" : "notice-warning"}`} role="status">
      <p>
        {shown.behind} {shown.stage !== null && `The values are those of ${shown.stage.name}.`}{" "}
        {!setUp && <a href={href(paths.setup(surgeryId))}>Set up the spine</a>}
      </p>
      {active && shown.newest !== null && (
        <p class="glance-progress">
          <progress value={shown.newest.latest.job.progress} aria-label={`Progress of ${shown.newest.name}`} />
          <span aria-hidden="true">{progressText(shown.newest.latest)}</span>
        </p>
      )}
    </div>
  );
}

interface ValueProps {
  title: string;
  /** What it is measured of. */
  of: string;
  value: MeasureValue | null;
  sign: string;
  /** Why there is no value. */
  none: string;
  change?: boolean;
}

function Value({ title, of, value, sign, none, change = false }: ValueProps): VNode {
  const number = value?.value ?? null;
  const assumed = value?.assumed === true;
  return (
    <div class="glance-value">
      <h3>
        {title} {of !== "" && <span class="muted">{of}</span>}
      </h3>
      {value === null || number === null ? (
        <p class="glance-none">
          <span class="glance-number" aria-hidden="true">
            {DASH}
          </span>
          <span>{value?.reason ?? none}</span>
        </p>
      ) : (
        <>
          <p class={`glance-number${assumed ? " glance-assumed" : ""}`}>
            {withUnit(change ? signed(number) : fixed(number), value.unit)}
          </p>
          <p class="glance-interval">{intervalOf(value)}</p>
        </>
      )}
      <p class="glance-note">
        {value !== null && number !== null && <StatusMark status={value.status} named />}
        {assumed && number !== null && <StatusMark status="assumed" named />}
        <span class="muted">{sign}</span>
      </p>
    </div>
  );
}

function State({ shown }: { shown: Glance }): VNode {
  const most = worst(shown.flags);
  const seconds = shown.stage === null ? null : age(shown.stage.captured_at ?? shown.stage.created_at, now.value);
  return (
    <div class="glance-value">
      <h3>
        Stage <span class="muted">{shown.stage?.captured_at == null ? "stored" : "captured"}</span>
      </h3>
      <p class={`glance-age${seconds !== null && seconds > OLD_S ? " glance-warning" : ""}`}>
        {seconds === null ? DASH : `${duration(seconds)} ago`}
      </p>
      {most === null ? (
        <p class="glance-flag glance-good">No flags</p>
      ) : (
        <p class={`glance-flag severity-${severity(most.code)}`}>
          <SeverityMark of={severity(most.code)} size={32} /> {flagName(most.code)}
          {shown.flags.length > 1 && <span class="muted"> and {shown.flags.length - 1} more</span>}
        </p>
      )}
      {most !== null && <p class="muted">{most.detail}</p>}
    </div>
  );
}

function curveText({ curve }: Glance): string {
  return curve === null ? "" : `${curve.upper}–${curve.lower}`;
}

function intervalOf({ interval: ends, unit }: MeasureValue): string {
  return ends == null ? "interval not determined" : interval(ends[0], ends[1], unit);
}

function noChange(shown: Glance): string {
  if (shown.stage === null) return "no stage with a spine";
  return shown.stage.name === shown.baseline ? "this is the baseline" : "no curve in the baseline";
}

async function toggleFullScreen(panel: HTMLElement | null): Promise<void> {
  if (document.fullscreenElement !== null) await document.exitFullscreen();
  else await panel?.requestFullscreen();
}
