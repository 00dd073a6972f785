/** Files with vertebra poses: CSV with a head line, or JSON, for the initial configuration and for the target. */
import type { InitialPoses, TargetVertebra, VertebraPose } from "../api/types";

export type Parsed<T> = { readonly items: readonly T[]; readonly fault: null } | { readonly items: null; readonly fault: string };

const REQUIRED = ["vertebra", "x_mm", "y_mm", "z_mm", "coronal_deg", "sagittal_deg", "axial_deg"] as const;
const DEVIATIONS = ["position_sd_mm", "rotation_sd_deg"] as const;
const ANGLES = ["coronal_deg", "sagittal_deg", "axial_deg"] as const;
const PLACE = ["x_mm", "y_mm", "z_mm"] as const;
const MAX_ROWS = 30;

/** The head line of a CSV file. */
export const CSV_HEAD = [...REQUIRED, ...DEVIATIONS].join(",");

/** Return the poses of a file, or what is wrong with it. */
export function parsePoses(text: string): Parsed<VertebraPose> {
  const trimmed = text.replace(/^\ufeff/, "").trim();
  if (trimmed === "") return wrong("The file is empty.");
  if (trimmed.startsWith("{") || trimmed.startsWith("[")) return fromJson(trimmed);
  return table(trimmed, REQUIRED, DEVIATIONS, (row) => ({
    vertebra: row.name,
    position_mm: PLACE.map((column) => row.number(column)),
    angles_deg: ANGLES.map((column) => row.number(column)),
    position_sd_mm: row.number("position_sd_mm", 0),
    rotation_sd_deg: row.number("rotation_sd_deg", 0),
  }));
}

/** Return the planned vertebrae of a CSV file: angles, and positions where they are planned. */
export function parseTarget(text: string): Parsed<TargetVertebra> {
  return table(text.replace(/^\ufeff/, "").trim(), ["vertebra", ...ANGLES], PLACE, (row) => ({
    vertebra: row.name,
    angles_deg: ANGLES.map((column) => row.number(column)),
    position_mm: PLACE.some((column) => row.has(column)) ? PLACE.map((column) => row.number(column)) : null,
  }));
}

/** Poses in the frame that was chosen. */
export function initialPoses(poses: readonly VertebraPose[], frame: InitialPoses["frame"]): InitialPoses {
  return { kind: "poses", frame, poses: [...poses] };
}

interface Row {
  readonly name: string;
  has(column: string): boolean;
  number(column: string, otherwise?: number): number;
}

function table<T>(text: string, required: readonly string[], optional: readonly string[], make: (row: Row) => T): Parsed<T> {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() !== "");
  const separator = (lines[0] ?? "").includes(";") ? ";" : ",";
  const head = (lines[0] ?? "").split(separator).map((name) => name.trim());
  const missing = required.filter((name) => !head.includes(name));
  if (missing.length > 0) return wrong(`The head line lacks ${missing.join(", ")}; it reads ${required.join(",")}.`);
  const unknown = head.filter((name) => !required.includes(name) && !optional.includes(name));
  if (unknown.length > 0) return wrong("The head line names columns that are not known. Leave them out.");
  if (lines.length < 2) return wrong("The file has a head line and nothing else.");
  if (lines.length - 1 > MAX_ROWS) return wrong(`The file has more than ${MAX_ROWS} vertebrae.`);
  const items: T[] = [];
  const names = new Set<string>();
  for (const [index, line] of lines.slice(1).entries()) {
    const cells = line.split(separator).map((cell) => cell.trim());
    if (cells.length !== head.length) return wrong(`Line ${index + 2} has ${cells.length} columns, not ${head.length}.`);
    const cell = (column: string): string => cells[head.indexOf(column)] ?? "";
    const name = cell("vertebra");
    if (!/^[CTLS][1-9][0-9]?$/.test(name)) return wrong(`Line ${index + 2} does not begin with a vertebra such as T9.`);
    if (names.has(name)) return wrong(`Line ${index + 2} gives ${name} a second time.`);
    names.add(name);
    let fault: string | null = null;
    const item = make({
      name,
      has: (column) => cell(column) !== "",
      number: (column, otherwise) => {
        const typed = cell(column);
        const value = typed === "" ? (otherwise ?? Number.NaN) : Number(separator === ";" ? typed.replace(",", ".") : typed);
        if (!Number.isFinite(value)) fault ??= `Line ${index + 2}: ${column} is not a number.`;
        return value;
      },
    });
    if (fault !== null) return wrong(fault);
    items.push(item);
  }
  return { items, fault: null };
}

function fromJson(text: string): Parsed<VertebraPose> {
  let document: unknown;
  try {
    document = JSON.parse(text);
  } catch {
    return wrong("The file is not valid JSON.");
  }
  const poses: unknown = Array.isArray(document) ? document : (document as { poses?: unknown }).poses;
  if (!Array.isArray(poses) || poses.length === 0) return wrong("The file has no list of poses.");
  if (poses.length > MAX_ROWS) return wrong(`The file has more than ${MAX_ROWS} vertebrae.`);
  for (const [index, pose] of poses.entries()) {
    const { vertebra, position_mm, rotation, angles_deg } = (pose ?? {}) as Record<string, unknown>;
    const isPlace = Array.isArray(position_mm) && position_mm.length === 3 && position_mm.every(Number.isFinite);
    if (typeof vertebra !== "string" || !isPlace) return wrong(`Pose ${index + 1} lacks vertebra or position_mm.`);
    if ((rotation == null) === (angles_deg == null)) return wrong(`Pose ${index + 1} needs either rotation or angles_deg.`);
  }
  return { items: poses as VertebraPose[], fault: null };
}

function wrong<T>(fault: string): Parsed<T> {
  return { items: null, fault };
}
