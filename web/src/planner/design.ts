/** A design of rig and marker: texts as typed, their limits, and the address that shares it. */

export interface Design {
  /** Calibration whose rig is planned with; empty for a rig that is to be built. */
  readonly calibration_id: string;
  readonly baseline_mm: string;
  readonly camera_height_mm: string;
  readonly focal_length_mm: string;
  readonly image_width_px: string;
  readonly image_height_px: string;
  readonly pixel_width_mm: string;
  readonly pixel_height_mm: string;
  readonly xx_mm: string;
  readonly yy_mm: string;
  readonly mx_mm: string;
  readonly ball_diameter_mm: string;
  /** Radius of the disc in which the best marker is found; empty for the given legs. */
  readonly disc_radius_mm: string;
  readonly levels: string;
  readonly spacing_mm: string;
  readonly spine_axis: string;
  readonly centre_sd_px: string;
  readonly common_sd_mrad: string;
  readonly depth_from_mm: string;
  readonly depth_to_mm: string;
}

export type Field = keyof Design;

export interface NumberField {
  readonly name: Field;
  readonly label: string;
  readonly unit: string;
  readonly low: number;
  readonly high: number;
  readonly isWhole?: boolean;
}

/** A rig and marker about like those of the cart. */
export const CART: Design = {
  calibration_id: "",
  baseline_mm: "422",
  camera_height_mm: "736",
  focal_length_mm: "7.7",
  image_width_px: "568",
  image_height_px: "416",
  pixel_width_mm: "0.01",
  pixel_height_mm: "0.00845",
  xx_mm: "18",
  yy_mm: "14",
  mx_mm: "10",
  ball_diameter_mm: "8",
  disc_radius_mm: "",
  levels: "L1,T11,T9,T7",
  spacing_mm: "50",
  spine_axis: "x",
  centre_sd_px: "0.1",
  common_sd_mrad: "0.12",
  depth_from_mm: "-60",
  depth_to_mm: "60",
};

export const RIG_FIELDS: readonly NumberField[] = [
  { name: "baseline_mm", label: "Baseline", unit: "mm", low: 50, high: 5000 },
  { name: "camera_height_mm", label: "Height of the cameras", unit: "mm", low: 100, high: 5000 },
  { name: "focal_length_mm", label: "Focal length", unit: "mm", low: 1, high: 500 },
  { name: "image_width_px", label: "Image width", unit: "px", low: 64, high: 20000, isWhole: true },
  { name: "image_height_px", label: "Image height", unit: "px", low: 64, high: 20000, isWhole: true },
  { name: "pixel_width_mm", label: "Pixel width", unit: "mm", low: 0.0005, high: 0.1 },
  { name: "pixel_height_mm", label: "Pixel height", unit: "mm", low: 0.0005, high: 0.1 },
];

export const LEG_FIELDS: readonly NumberField[] = [
  { name: "xx_mm", label: "Leg XX", unit: "mm", low: 2, high: 100 },
  { name: "yy_mm", label: "Leg YY", unit: "mm", low: 2, high: 100 },
  { name: "mx_mm", label: "Leg MX", unit: "mm", low: 2, high: 100 },
];

export const DISC_FIELD: NumberField = { name: "disc_radius_mm", label: "Radius of the disc", unit: "mm", low: 5, high: 100 };
export const BALL_FIELD: NumberField = { name: "ball_diameter_mm", label: "Ball diameter", unit: "mm", low: 1, high: 30 };

export const TRIAD_FIELDS: readonly NumberField[] = [
  { name: "spacing_mm", label: "Distance of neighbours", unit: "mm", low: 1, high: 200 },
  { name: "centre_sd_px", label: "Centre of a ball, sd", unit: "px", low: 0.001, high: 5 },
  { name: "common_sd_mrad", label: "Shared pointing error, sd", unit: "mrad", low: 0, high: 5 },
  { name: "depth_from_mm", label: "Depth from", unit: "mm", low: -2000, high: 2000 },
  { name: "depth_to_mm", label: "Depth to", unit: "mm", low: -2000, high: 2000 },
];

const ALL_NUMBERS = [...RIG_FIELDS, ...LEG_FIELDS, DISC_FIELD, BALL_FIELD, ...TRIAD_FIELDS];
const LEVELS = /^[CTLS][1-9][0-9]?(,[CTLS][1-9][0-9]?){0,23}$/;
const LEGS = new Set<Field>(LEG_FIELDS.map(({ name }) => name));
const RIG = new Set<Field>(RIG_FIELDS.map(({ name }) => name));

/** Whether a field counts in a design: a calibration replaces the rig, a disc the legs. */
export function isUsed(design: Design, name: Field): boolean {
  if (RIG.has(name)) return design.calibration_id === "";
  if (LEGS.has(name)) return design.disc_radius_mm.trim() === "";
  return true;
}

/** What is wrong with a design, by field; empty when it can be computed. */
export function faultsOf(design: Design): Partial<Record<Field, string>> {
  const faults: Partial<Record<Field, string>> = {};
  for (const { name, low, high, unit, isWhole } of ALL_NUMBERS) {
    const typed = design[name].trim();
    if (!isUsed(design, name) || (name === "disc_radius_mm" && typed === "")) continue;
    const value = Number(typed.replace(",", "."));
    if (typed === "" || !Number.isFinite(value)) faults[name] = "give a number";
    else if (isWhole && !Number.isInteger(value)) faults[name] = "give a whole number";
    else if (value < low || value > high) faults[name] = `from ${low} to ${high} ${unit}`;
  }
  if (!LEVELS.test(levelText(design.levels))) faults.levels = "name vertebrae along the spine, such as L1, T11, T9";
  if (faults.depth_from_mm === undefined && faults.depth_to_mm === undefined) {
    if (!(numberOf(design, "depth_from_mm") < numberOf(design, "depth_to_mm"))) {
      faults.depth_to_mm = "must lie above the other end";
    }
  }
  return faults;
}

/** The number of a field that has no fault. */
export function numberOf(design: Design, name: Field): number {
  return Number(design[name].replace(",", "."));
}

/** The query of a plan; the same for designs that differ only in what does not count. */
export function queryOf(design: Design): string {
  const query = new URLSearchParams();
  for (const [name, typed] of Object.entries(design) as [Field, string][]) {
    const text = name === "levels" ? levelText(typed) : typed.trim();
    if (text !== "" && isUsed(design, name)) query.set(name, ALL_NUMBERS.some((each) => each.name === name) ? text.replace(",", ".") : text);
  }
  return query.toString();
}

/** The query of the disparities of a design's rig. */
export function disparityQueryOf(design: Design): string {
  const all = new URLSearchParams(queryOf(design));
  const query = new URLSearchParams();
  for (const name of ["calibration_id", ...RIG, "depth_from_mm", "depth_to_mm"]) {
    const value = all.get(name);
    if (value !== null) query.set(name, value);
  }
  return query.toString();
}

/** The part of an address after `?` that stands for one or two designs; what is as on the cart is left out. */
export function addressOf(first: Design, second: Design | null): string {
  const query = new URLSearchParams();
  for (const [prefix, design] of [["", first], ["b.", second]] as const) {
    if (design === null) continue;
    if (prefix !== "") query.set("compare", "1");
    for (const name of Object.keys(CART) as Field[]) if (design[name] !== CART[name]) query.set(prefix + name, design[name]);
  }
  return query.toString();
}

/** The designs of an address; what it does not name is as on the cart. */
export function designsOf(address: string): { first: Design; second: Design | null } {
  const query = new URLSearchParams(address.includes("?") ? address.slice(address.indexOf("?") + 1) : "");
  const read = (prefix: string): Design => {
    const entries = (Object.keys(CART) as Field[]).map((name) => [name, (query.get(prefix + name) ?? CART[name]).slice(0, 200)]);
    return Object.fromEntries(entries) as unknown as Design;
  };
  return { first: read(""), second: query.get("compare") === "1" ? read("b.") : null };
}

export interface BuiltRig {
  readonly baseline_mm: number;
  readonly height_mm: number;
  readonly focal_length_mm: number;
  readonly image_size_px: readonly number[];
  readonly pixel_size_mm: readonly number[];
}

/** The same field of view from the ceiling: the focal length grows with the distance; baseline and height are given. */
export function ceilingVariant(design: Design, rig: BuiltRig, heightMm: number, baselineMm: number): Design {
  const slant = (baseline: number, height: number): number => Math.hypot(baseline / 2, height);
  const focal = (rig.focal_length_mm * slant(baselineMm, heightMm)) / slant(rig.baseline_mm, rig.height_mm);
  const text = (value: number | undefined, digits: number): string => String(Number((value ?? 0).toFixed(digits)));
  return {
    ...design,
    calibration_id: "",
    baseline_mm: text(baselineMm, 1),
    camera_height_mm: text(heightMm, 1),
    focal_length_mm: text(focal, 2),
    image_width_px: text(rig.image_size_px[0], 0),
    image_height_px: text(rig.image_size_px[1], 0),
    pixel_width_mm: text(rig.pixel_size_mm[0], 6),
    pixel_height_mm: text(rig.pixel_size_mm[1], 6),
  };
}

function levelText(typed: string): string {
  return typed.toUpperCase().split(/[\s,;]+/).filter((name) => name !== "").join(",");
}
