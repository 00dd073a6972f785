/** Radiographs of a surgery: upload, landmarks, the seven-parameter fit. */
import type { VNode } from "preact";
import { useMemo, useState } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { Radiograph, RadiographPage, Surgery } from "../api/types";
import { Failure } from "../app/failure";
import { href, paths } from "../app/route";
import { fixed } from "../format/numbers";
import { dayAndTime } from "../format/time";
import { useStoredSetup, type StoredState } from "../setup/stored";
import { Digitizer } from "./digitizer";
import { fromDocument } from "./document";
import { keptDraft } from "./draft-store";
import { emptyLandmarks, VIEW_NAMES, type View } from "./landmarks";
import { span } from "./levels";
import "./radiographs.css";
import { UploadForm } from "./upload";

/** The page of a surgery's radiographs. */
export function RadiographsPage({ surgeryId }: { surgeryId: string }): VNode {
  const path = `/v1/surgeries/${encodeURIComponent(surgeryId)}`;
  const surgery = useResource<Surgery>(path);
  const radiographs = useResource<RadiographPage>(`${path}/radiographs?limit=200`);
  const { stored, reload } = useStoredSetup(surgeryId);
  return (
    <div class="stack">
      <div class="page-heading">
        <h1>Radiographs</h1>
        {surgery.state === "ready" && <a href={href(paths.surgery(surgeryId))}>{surgery.value.reference}</a>}
        <a href={href(paths.setup(surgeryId))}>Setup of the spine</a>
      </div>
      <Resource of={surgery} loading="Loading the surgery">
        {(found) => (
          <Resource of={radiographs} loading="Loading the radiographs">
            {(page) => <Pair surgery={found} radiographs={page.items} stored={stored} reload={reload} />}
          </Resource>
        )}
      </Resource>
    </div>
  );
}

interface PairProps {
  surgery: Surgery;
  radiographs: readonly Radiograph[];
  stored: StoredState;
  reload: () => Promise<void>;
}

/** The pair that is digitized, or the forms of what is missing of it. */
function Pair({ surgery, radiographs, stored, reload }: PairProps): VNode {
  const draft = useMemo(() => keptDraft(surgery.id), [surgery.id]);
  const initial = stored.state === "ready" ? stored.stored?.value.setup.initial : undefined;
  const document = initial?.kind === "radiographs" ? initial : null;
  const [chosen, setChosen] = useState<Partial<Record<View, string>>>({});
  const [adding, setAdding] = useState(false);
  if (stored.state === "loading") return <p class="loading" role="status">Loading the setup …</p>;
  if (stored.state === "failed") return <Failure problem={stored.problem} />;

  const of = (view: View): Radiograph | undefined => {
    const mine = radiographs.filter((each) => each.view === view);
    const wanted = [chosen[view], draft?.[view], document?.[view]];
    return wanted.map((id) => mine.find((each) => each.id === id)).find((each) => each !== undefined) ?? mine[0];
  };
  const [pa, lateral] = [of("pa"), of("lateral")];
  const isDraft = draft !== null && draft.pa === pa?.id && draft.lateral === lateral?.id;
  const isStored = document !== null && document.pa === pa?.id && document.lateral === lateral?.id;
  const start = isDraft
    ? draft
    : isStored
      ? { landmarks: fromDocument(document), sdPx: document.landmark_sd_px ?? 1, stage: null }
      : { landmarks: emptyLandmarks(span(surgery.vertebrae, surgery.extra_levels)), sdPx: 1, stage: null };
  const missing = (["pa", "lateral"] as const).filter((view) => of(view) === undefined);
  return (
    <>
      {radiographs.length > 0 && (
        <div class="panel row spread no-print">
          {(["pa", "lateral"] as const).map((view) => (
            <Choice view={view} radiographs={radiographs} value={of(view)} onChange={(id) => setChosen({ ...chosen, [view]: id })} />
          ))}
          <button type="button" class="button" aria-expanded={adding} onClick={() => setAdding(!adding)}>Add a radiograph</button>
        </div>
      )}
      {(missing.length > 0 || adding) && (
        <div class="upload-pair">
          {(adding ? (["pa", "lateral"] as const) : missing).map((view) => (
            <UploadForm
              key={view}
              surgeryId={surgery.id}
              view={view}
              onDone={({ id }) => {
                setChosen({ ...chosen, [view]: id });
                setAdding(false);
              }}
            />
          ))}
        </div>
      )}
      {pa !== undefined && lateral !== undefined && (
        <Digitizer
          key={`${pa.id} ${lateral.id}`}
          surgery={surgery}
          pa={pa}
          lateral={lateral}
          start={start}
          stored={stored.stored}
          reload={reload}
        />
      )}
    </>
  );
}

interface ChoiceProps {
  view: View;
  radiographs: readonly Radiograph[];
  value: Radiograph | undefined;
  onChange: (id: string) => void;
}

function Choice({ view, radiographs, value, onChange }: ChoiceProps): VNode | null {
  const mine = radiographs.filter((each) => each.view === view);
  if (value === undefined) return null;
  const [row, column] = value.pixel_spacing_mm;
  const source = { given: "as typed", pixel_spacing: "DICOM, at the patient", imager_pixel_spacing: "DICOM, at the detector" };
  return (
    <div class="field">
      <label for={`choice-${view}`}>{VIEW_NAMES[view]} view</label>
      <select id={`choice-${view}`} value={value.id} onChange={(event) => onChange(event.currentTarget.value)}>
        {mine.map((each) => (
          <option value={each.id}>{`${dayAndTime(each.created_at)}, ${each.image.width_px} × ${each.image.height_px} px`}</option>
        ))}
      </select>
      <span class={value.spacing_source === "imager_pixel_spacing" ? "hint badge-warning" : "hint"}>
        {`${fixed(row, 3)} × ${fixed(column, 3)} mm (${source[value.spacing_source]})`}
      </span>
    </div>
  );
}
