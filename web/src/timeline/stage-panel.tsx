/** One stage: its takes, its flags, and what can be done with it. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { ProblemError, send } from "../api/client";
import { refresh } from "../api/resource";
import type { Job, Stage, SurgerySummary } from "../api/types";
import { Failure } from "../app/failure";
import { href, paths } from "../app/route";
import { FlagList } from "../format/flag-list";
import { clock, dayAndTime } from "../format/time";
import { permits } from "../state/session";
import { StateMark } from "../surgeries/state-mark";
import "./stage-panel.css";
import { flagsOf, progressText, type StageGroup } from "./stages";

interface StagePanelProps {
  surgeryId: string;
  group: StageGroup;
  summary: SurgerySummary | null;
  /** Begin another take of the stage. */
  onRetake: (name: string) => void;
}

/** The details of a stage. */
export function StagePanel({ surgeryId, group, summary, onRetake }: StagePanelProps): VNode {
  const { counted, latest } = group;
  const spine = summary?.stages.find(({ name }) => name === group.name);
  return (
    <section class="panel stack" aria-labelledby="stage-heading">
      <header>
        <h2 id="stage-heading">Stage {group.name}</h2>
        <span class="row no-print">
          {group.active && permits("capture:write") && <CancelButton stage={latest} />}
          {!group.active && permits("capture:write") && (
            <button type="button" class="button button-small" onClick={() => onRetake(group.name)}>
              Take again
            </button>
          )}
          <a class="button button-small" href={href(paths.images(surgeryId, group.name))}>
            Images and corrections
          </a>
        </span>
      </header>
      {latest.job.error !== null && (
        <div class="failure">
          <strong>
            Take {latest.take} failed: {latest.job.error.title}
          </strong>
          <p>{latest.job.error.detail}</p>
        </div>
      )}
      {group.active && (
        <p class="stage-progress">
          Take {latest.take}: {progressText(latest)}
          <progress value={latest.job.progress} aria-label={`Progress of ${group.name}`} />
        </p>
      )}
      <dl class="facts">
        <Fact name="Captured">{counted.captured_at === null ? <NotSent /> : `${dayAndTime(counted.captured_at)}:${clock(counted.captured_at).slice(6)}`}</Fact>
        <Fact name="Stored">{`${dayAndTime(counted.created_at)}:${clock(counted.created_at).slice(6)}`}</Fact>
        <Fact name="Pairs">{counted.pairs === 1 ? "1" : `${counted.pairs}, a burst`}</Fact>
        <Fact name="Triads">{counted.triads ?? "–"}</Fact>
        <Fact name="Calibration">
          <a href={href(paths.calibration(counted.calibration_id))}>show</a>
        </Fact>
        <Fact name="Measured by">{counted.version === null ? "–" : `Spinewatch ${counted.version}`}</Fact>
        {counted.labelled_by != null && <Fact name="Labels from">{counted.labelled_by.stage}</Fact>}
      </dl>
      {spine?.spine_reason != null && <p class="notice">No spine: {spine.spine_reason}.</p>}
      <div>
        <h3 class="label">Flags</h3>
        <FlagList flags={flagsOf(group, summary)} none={counted.flags === null ? "Not measured yet." : "No flags."} />
      </div>
      {group.takes.length > 1 && <Takes group={group} />}
    </section>
  );
}

function NotSent(): VNode {
  return <span class="muted">time not sent</span>;
}

function Fact({ name, children }: { name: string; children: VNode | string | number }): VNode {
  return (
    <div>
      <dt class="label">{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

function Takes({ group }: { group: StageGroup }): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label={`Takes of ${group.name}`}>
      <table>
        <caption>Takes and revisions; all are kept.</caption>
        <thead>
          <tr>
            <th scope="col">Take</th>
            <th scope="col">State</th>
            <th scope="col">Stored</th>
            <th scope="col">What</th>
          </tr>
        </thead>
        <tbody>
          {[...group.takes].reverse().map((take) => (
            <tr>
              <th scope="row">
                {take.take}
                {take === group.counted && <span class="muted"> (counts)</span>}
              </th>
              <td>
                <StateMark state={take.state} />
              </td>
              <td>{dayAndTime(take.created_at)}</td>
              <td class="muted">
                {take.revision == null ? "images of its own" : `revision of take ${take.revision.of_take}, by ${take.revision.by}`}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function CancelButton({ stage }: { stage: Stage }): VNode {
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const cancel = async (): Promise<void> => {
    try {
      await send<Job>("POST", `/v1/jobs/${stage.job.id}/cancel`);
      refresh(`/v1/surgeries/${stage.surgery_id}`);
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      setProblem(error);
    }
  };
  return (
    <>
      {problem !== null && <Failure problem={problem} />}
      <button type="button" class="button button-small" onClick={() => void cancel()}>
        Cancel the measurement
      </button>
    </>
  );
}
