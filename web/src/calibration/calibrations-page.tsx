/** All calibrations: how old, how accurate, which doubts; and new ones. */
import type { VNode } from "preact";
import { useEffect } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { Calibration, CalibrationPage } from "../api/types";
import { href, paths } from "../app/route";
import { SeverityMark } from "../format/flag-list";
import { flagName, ranked, severity } from "../format/flags";
import { Quantity } from "../format/quantity";
import { dayAndTime } from "../format/time";
import { now } from "../state/now";
import { permits } from "../state/session";
import { AXES } from "./accuracy";
import { ageText } from "./age";
import "./calibration.css";
import { NewCalibration } from "./new-calibration-panel";

const LIMIT = 200;

/** The list of calibrations. */
export function CalibrationsPage(): VNode {
  const calibrations = useResource<CalibrationPage>(`/v1/calibrations?limit=${LIMIT}`);
  useEffect(() => {
    document.title = "Calibrations · Spinewatch";
  }, []);
  return (
    <div class="stack">
      <h1 tabIndex={-1}>Calibrations</h1>
      <section class="panel" aria-labelledby="calibrations-title">
        <header>
          <h2 id="calibrations-title">Rigs</h2>
        </header>
        <Resource
          of={calibrations}
          loading="Loading the calibrations"
          empty={(page) => (page.items.length === 0 ? <p>No calibration yet. Send a rig, or shots of a control field.</p> : null)}
        >
          {(page) => <CalibrationTable page={page} />}
        </Resource>
      </section>
      {permits("capture:write") && <NewCalibration />}
    </div>
  );
}

function CalibrationTable({ page }: { page: CalibrationPage }): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label="Calibrations">
      <table class="calibrations-table">
        <caption>
          Newest first. Accuracy is the standard deviation of control points in object space, each reconstructed by the rig without it.
          {page.total > page.items.length && ` The newest ${page.items.length} of ${page.total} are shown.`}
        </caption>
        <thead>
          <tr>
            <th scope="col">Rig</th>
            <th scope="col">Calibrated</th>
            <th scope="col">Age</th>
            <th scope="col">Made from</th>
            {AXES.map((axis) => (
              <th scope="col" class="number">{axis}, mm</th>
            ))}
            <th scope="col">Flags</th>
          </tr>
        </thead>
        <tbody>
          {page.items.map((calibration) => (
            <CalibrationRow key={calibration.id} calibration={calibration} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function CalibrationRow({ calibration }: { calibration: Calibration }): VNode {
  const { brief } = calibration;
  return (
    <tr data-calibration={calibration.id}>
      <th scope="row">
        <a href={href(paths.calibration(calibration.id))}>{calibration.name}</a>
      </th>
      <td>{calibration.calibrated_at === null ? <span class="muted">unknown; stored {dayAndTime(calibration.created_at)}</span> : dayAndTime(calibration.calibrated_at)}</td>
      <td>{ageText(calibration, now.value)}</td>
      <td>{calibration.has_report ? "images" : "a rig file"}</td>
      {AXES.map((_, axis) => (
        <td class="number">
          <Quantity
            value={brief?.leave_one_out_sd_mm?.[axis]}
            unit=""
            digits={3}
            reason={brief === null ? "calibrated elsewhere: its accuracy is not known here" : "not determined: no point can be left out"}
          />
        </td>
      ))}
      <td>
        {brief === null ? (
          <span class="muted small">not checked here</span>
        ) : (
          <ul class="check-flags">
            {brief.flags.length === 0 && <li class="muted">none</li>}
            {ranked(brief.flags).map((flag) => (
              <li title={flag.detail}>
                <SeverityMark of={severity(flag.code)} size={14} /> {flagName(flag.code)}
                <span class="visually-hidden">: {flag.detail}</span>
              </li>
            ))}
          </ul>
        )}
      </td>
    </tr>
  );
}
