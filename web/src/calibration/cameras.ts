/** Parameters of both cameras with their deviations, and how well they are determined. */
import type { CalibrationReport, Camera, Rig } from "../api/types";

export interface ParameterValue {
  readonly value: number;
  /** Null for a parameter that was held. */
  readonly sd: number | null;
  /** Deviation above which it counts as not determined; null where there is no such limit. */
  readonly limit: number | null;
  readonly held: boolean;
}

export interface ParameterRow {
  readonly name: string;
  readonly meaning: string;
  readonly unit: string;
  readonly left: ParameterValue;
  readonly right: ParameterValue;
}

interface Parameter {
  readonly name: string;
  readonly meaning: string;
  readonly unit: string;
  readonly of: (camera: Camera) => number | undefined;
}

const PARAMETERS: readonly Parameter[] = [
  { name: "X0", meaning: "perspective centre, X", unit: "mm", of: (camera) => camera.position_mm[0] },
  { name: "Y0", meaning: "perspective centre, Y", unit: "mm", of: (camera) => camera.position_mm[1] },
  { name: "Z0", meaning: "perspective centre, Z", unit: "mm", of: (camera) => camera.position_mm[2] },
  { name: "omega", meaning: "rotation about X", unit: "deg", of: (camera) => camera.rotation_deg[0] },
  { name: "phi", meaning: "rotation about Y", unit: "deg", of: (camera) => camera.rotation_deg[1] },
  { name: "kappa", meaning: "rotation about Z", unit: "deg", of: (camera) => camera.rotation_deg[2] },
  { name: "f", meaning: "focal length", unit: "mm", of: (camera) => camera.focal_length_mm },
  { name: "x0", meaning: "principal point, x", unit: "mm", of: (camera) => camera.principal_point_mm[0] },
  { name: "y0", meaning: "principal point, y", unit: "mm", of: (camera) => camera.principal_point_mm[1] },
  { name: "K1", meaning: "radial distortion", unit: "mm\u207b\u00b2", of: (camera) => camera.radial[0] },
  { name: "K2", meaning: "radial distortion", unit: "mm\u207b\u2074", of: (camera) => camera.radial[1] },
  { name: "P1", meaning: "decentering distortion", unit: "mm\u207b\u00b9", of: (camera) => camera.decentering[0] },
  { name: "P2", meaning: "decentering distortion", unit: "mm\u207b\u00b9", of: (camera) => camera.decentering[1] },
  { name: "aspect", meaning: "height over width of a pixel", unit: "", of: ({ pixel_size_mm: [px = 1, py = 1] }) => py / px },
];

/** Return the parameters; a rig without a report has values alone. */
export function parameterRows(rig: Rig, report: CalibrationReport | null): ParameterRow[] {
  return PARAMETERS.map(({ name, meaning, unit, of }) => {
    const side = (which: "left" | "right"): ParameterValue => {
      const quality = report?.cameras[which] ?? null;
      return {
        value: of(rig[which]) ?? Number.NaN,
        sd: quality?.sd[name] ?? null,
        limit: quality?.sd_limits?.[name] ?? null,
        held: quality !== null && !quality.free.includes(name),
      };
    };
    return { name, meaning, unit, left: side("left"), right: side("right") };
  });
}

/** Return a number with as many digits as its deviation supports, one more than its first. */
export function withDigits(value: number, sd: number | null): { value: string; sd: string } {
  const minus = (text: string): string => text.replaceAll("-", "\u2212");
  if (sd === null || !(sd > 0)) return { value: minus(String(Number(value.toPrecision(6)))), sd: "" };
  const digits = Math.max(0, 1 - Math.floor(Math.log10(sd)));
  if (digits > 6) return { value: minus(value.toExponential(3)), sd: minus(sd.toExponential(1)) };
  return { value: minus(value.toFixed(digits)), sd: sd.toFixed(digits) };
}
