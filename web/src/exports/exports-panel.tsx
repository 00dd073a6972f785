/** The report and every export of a surgery, each by one click. */
import type { VNode } from "preact";

import "./exports.css";

const FILES: readonly { format: string; label: string; what: string }[] = [
  { format: "report-pdf", label: "Report, PDF", what: "to print and to file" },
  { format: "report-html", label: "Report, HTML", what: "to read on a screen" },
  { format: "csv", label: "CSV", what: "tables for statistics" },
  { format: "json", label: "JSON", what: "everything, at full precision" },
  { format: "slicer-markups", label: "Slicer markups", what: "points for 3D Slicer" },
  { format: "slicer-transforms", label: "Slicer transforms", what: "motion for 3D Slicer" },
  { format: "gltf", label: "glTF", what: "the spine as a 3D model" },
  { format: "fhir", label: "FHIR", what: "observations for a record" },
  { format: "dicom-sr", label: "DICOM SR", what: "measurements for a PACS" },
];

/** Links to the files of a surgery. */
export function ExportsPanel({ surgeryId }: { surgeryId: string }): VNode {
  return (
    <section class="panel no-print" aria-labelledby="exports-heading">
      <header>
        <h2 id="exports-heading">Report and exports</h2>
      </header>
      <ul class="exports">
        {FILES.map(({ format, label, what }) => (
          <li>
            <a class="button" download href={`/v1/surgeries/${encodeURIComponent(surgeryId)}/exports/${format}`}>
              {label}
            </a>
            <span class="muted small">{what}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}
