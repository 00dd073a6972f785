/** The stages of a surgery as a time line. */
import type { VNode } from "preact";
import { useEffect, useRef } from "preact/hooks";

import type { SurgerySummary } from "../api/types";
import { href, paths } from "../app/route";
import { SeverityMark } from "../format/flag-list";
import { severity, worst } from "../format/flags";
import { clock } from "../format/time";
import { StateMark } from "../surgeries/state-mark";
import { flagsOf, progressText, type StageGroup } from "./stages";
import "./timeline.css";

interface TimelineProps {
  surgeryId: string;
  groups: readonly StageGroup[];
  summary: SurgerySummary | null;
  /** Name of the stage whose details are shown. */
  selected: string | null;
}

/** The stages in order, each a link that shows its details. */
export function Timeline({ surgeryId, groups, summary, selected }: TimelineProps): VNode {
  const list = useRef<HTMLOListElement>(null);
  useEffect(() => {
    list.current?.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }, [selected, groups.length]);
  return (
    <nav class="panel timeline" aria-label="Stages">
      <ol ref={list}>
        {groups.map((group) => (
          <li key={group.name} class={`timeline-${group.latest.state}`}>
            <StageLink surgeryId={surgeryId} group={group} summary={summary} current={group.name === selected} />
          </li>
        ))}
      </ol>
    </nav>
  );
}

interface StageLinkProps {
  surgeryId: string;
  group: StageGroup;
  summary: SurgerySummary | null;
  current: boolean;
}

function StageLink({ surgeryId, group, summary, current }: StageLinkProps): VNode {
  const flags = flagsOf(group, summary);
  const most = worst(flags);
  return (
    <a href={href(paths.stage(surgeryId, group.name))} aria-current={current ? "true" : undefined}>
      <span class="timeline-rail" aria-hidden="true" />
      <strong>{group.name}</strong>
      <span class="muted small">{clock(group.time)}</span>
      {group.active ? (
        <span class="small timeline-progress">
          <progress value={group.latest.job.progress} aria-label={`Progress of ${group.name}`} />
          {progressText(group.latest)}
        </span>
      ) : (
        <span class="row small">
          {group.latest.state === "succeeded" ? <span class="timeline-done">measured</span> : <StateMark state={group.latest.state} />}
          {most !== null && (
            <span class="timeline-flags">
              <SeverityMark of={severity(most.code)} size={14} /> {flags.length}
              <span class="visually-hidden"> {flags.length === 1 ? "flag" : "flags"}</span>
            </span>
          )}
          {group.takes.length > 1 && <span class="muted">{group.takes.length} takes</span>}
        </span>
      )}
    </a>
  );
}
