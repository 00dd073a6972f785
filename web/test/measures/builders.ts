import type { Attribution, Curve, MeasureValue, Share, SpineChange, StageSpine, SummaryStage, VertebraChange } from "../../src/api/types";

export const CURVE: Curve = { name: "curve 1", upper: "T5", apex: "T8", lower: "T12", side: "right", open_ends: [] };

export function measure(changes: Partial<MeasureValue> = {}): MeasureValue {
  return {
    definition: "cobb-fixed",
    curve: "curve 1",
    levels: ["T5", "T12"],
    unit: "deg",
    value: 50,
    sd: 1,
    interval: [48, 52],
    status: "measured",
    assumed: false,
    reason: null,
    ...changes,
  };
}

export function share(value: number | null, sd = 1): Share {
  return { value, sd: value === null ? null : sd, interval: value === null ? null : [value - 2 * sd, value + 2 * sd] };
}

export function attribution(changes: Partial<Attribution> = {}): Attribution {
  return {
    subject: "curve 1",
    quantity: "cobb-fixed",
    unit: "deg",
    total: share(-10),
    rotation: share(-6),
    distraction: share(-3.5),
    remainder: -0.5,
    reason: null,
    ...changes,
  };
}

export function motion(vertebra: string, changes: Partial<VertebraChange> = {}): VertebraChange {
  return {
    vertebra,
    origin: "measured",
    reason: null,
    translation_mm: [1, -2, 3],
    translation_sd_mm: [0.1, 0.2, 0.3],
    rotation: null,
    rotation_vector_deg: [0, 0, 0],
    rotation_sd_deg: [1, 1, 1],
    angle_deg: 0,
    angle_sd_deg: 1,
    derotation_deg: 4,
    derotation_sd_deg: 0.4,
    coronal_deg: -5,
    coronal_sd_deg: 0.5,
    sagittal_deg: 6,
    sagittal_sd_deg: 0.6,
    distraction_mm: 7,
    distraction_sd_mm: 0.7,
    ...changes,
  };
}

export function change(since: string, changes: Partial<SpineChange> = {}): SpineChange {
  return { since: { name: since, take: 1, calibration_id: "c" }, vertebrae: [], measures: [], attribution: [], ...changes };
}

export function stage(name: string, spine: Partial<StageSpine> | null, reason: string | null = null): SummaryStage {
  const whole = spine === null ? null : { stage: name, curves: [CURVE], measures: [], since_baseline: null, since_previous: null, ...spine };
  return { name, spine: whole, spine_reason: reason, flags: [] } as unknown as SummaryStage;
}
