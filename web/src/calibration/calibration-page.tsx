/** One calibration: how good it is, what it was made from, and whether the rig has moved since. */
import type { VNode } from "preact";
import { useEffect } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { CalibrationDetail, CalibrationReport } from "../api/types";
import { href, paths } from "../app/route";
import { FlagList } from "../format/flag-list";
import { dayAndTime } from "../format/time";
import { now } from "../state/now";
import { AccuracyPanel } from "./accuracy-panel";
import { ageText } from "./age";
import "./calibration.css";
import { CameraPanel, CorrelationPanel, GeometryPanel } from "./camera-panel";
import { DriftPanel } from "./drift-panel";
import { ResidualPanel } from "./residual-panel";

/** The page of a calibration. */
export function CalibrationPage({ id }: { id: string }): VNode {
  const path = `/v1/calibrations/${encodeURIComponent(id)}`;
  const calibration = useResource<CalibrationDetail>(path);
  const name = calibration.state === "ready" ? calibration.value.name : "Calibration";
  useEffect(() => {
    document.title = `${name} · Spinewatch`;
  }, [name]);
  return (
    <div class="stack">
      <p class="no-print">
        <a href={href(paths.calibrations)}>All calibrations</a>
      </p>
      <h1 tabIndex={-1}>{name}</h1>
      <Resource of={calibration} loading="Loading the calibration">
        {(value) => <Shown calibration={value} />}
      </Resource>
    </div>
  );
}

function Shown({ calibration }: { calibration: CalibrationDetail }): VNode {
  const { report } = calibration;
  return (
    <>
      <Overview calibration={calibration} />
      {report === null ? (
        <p class="notice">This rig was calibrated elsewhere. It has no images, residuals or accuracy here; the stages measured with it still show its drift.</p>
      ) : (
        <>
          <AccuracyPanel report={report} />
          <ResidualPanel calibration={calibration} report={report} />
        </>
      )}
      <DriftPanel id={calibration.id} />
      <CameraPanel rig={calibration.rig} report={report} />
      {report !== null && (
        <div class="calibration-pair">
          <GeometryPanel report={report} />
          <CorrelationPanel report={report} />
        </div>
      )}
      {report !== null && <ShotsPanel id={calibration.id} report={report} />}
    </>
  );
}

function Overview({ calibration }: { calibration: CalibrationDetail }): VNode {
  const { report, checks } = calibration;
  return (
    <section class="panel" aria-labelledby="overview-title">
      <header>
        <h2 id="overview-title">State</h2>
        {report !== null && (
          <a class="button button-small no-print" href={`/v1/calibrations/${encodeURIComponent(calibration.id)}/report`} target="_blank" rel="noreferrer">
            Report to print
          </a>
        )}
      </header>
      <dl class="overview">
        <div>
          <dt>Age</dt>
          <dd class="overview-large">{ageText(calibration, now.value)}</dd>
        </div>
        <div>
          <dt>Calibrated</dt>
          <dd>{calibration.calibrated_at === null ? `unknown; stored ${dayAndTime(calibration.created_at)}` : dayAndTime(calibration.calibrated_at)}</dd>
        </div>
        <div>
          <dt>Control field</dt>
          <dd>{report === null ? "calibrated elsewhere" : `${report.control_field.name}, ${report.control_field.points} points`}</dd>
        </div>
        <div>
          <dt>Stages measured with it</dt>
          <dd>
            {checks.stages}
            {checks.stages > 0 && `: the rig had moved in ${checks.drifted}, it was too old in ${checks.old}`}
          </dd>
        </div>
        <div>
          <dt>Version</dt>
          <dd>{report === null ? "–" : report.version}</dd>
        </div>
      </dl>
      {report !== null && <FlagList flags={report.flags} none="No flags: nothing about the calibration is doubtful." />}
    </section>
  );
}

function ShotsPanel({ id, report }: { id: string; report: CalibrationReport }): VNode {
  return (
    <section class="panel" aria-labelledby="shots-title">
      <header>
        <h2 id="shots-title">Shots</h2>
      </header>
      <ul class="shots">
        {report.shots.map((shot) => (
          <li>
            <div class="shots-pair">
              {(["left", "right"] as const).map((side) => {
                const path = `/v1/calibrations/${encodeURIComponent(id)}/shots/${shot.number}/images/${side}`;
                return (
                  <a href={path} target="_blank" rel="noreferrer">
                    <img src={path} alt={`Shot ${shot.number}, ${side} image`} loading="lazy" width={shot.images[side].width_px} height={shot.images[side].height_px} />
                  </a>
                );
              })}
            </div>
            <p class="small">
              Shot {shot.number}: {shot.used ? "adjusted" : "held out for verification"}, {shot.points.left.length} points left, {shot.points.right.length} right
            </p>
          </li>
        ))}
      </ul>
    </section>
  );
}
