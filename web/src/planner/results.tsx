/** What is expected of one or two designs: the figures side by side, per vertebra and over the depth. */
import type { VNode } from "preact";

import type { AccuracyPlan, DisparityPlan } from "../api/types";
import { DASH, fixed, withUnit } from "../format/numbers";
import { type Line, LinePlot } from "./line-plot";
import { MarkerDrawing } from "./marker-drawing";

type Name = "A" | "B";
export interface Planned {
  readonly name: Name;
  readonly plan: AccuracyPlan;
}

const FIGURES: readonly (readonly [string, string, (plan: AccuracyPlan) => number | null, string, number])[] = [
  ["cobb", "Cobb angle at one stage, sd", (plan) => plan.cobb_sd_deg, "deg", 2],
  ["sd-x", "Position along X, sd", (plan) => worst(plan, 0), "mm", 3],
  ["sd-y", "Position along Y, sd", (plan) => worst(plan, 1), "mm", 3],
  ["sd-z", "Position along Z, sd", (plan) => worst(plan, 2), "mm", 3],
  ["in-plane", "Rotation about the normal, sd", (plan) => most(plan.triads.map((triad) => triad.in_plane_sd_deg)), "deg", 2],
  ["out-of-plane", "Rotation out of the plane, sd", (plan) => most(plan.triads.map((triad) => triad.out_of_plane_sd_deg)), "deg", 2],
  ["motion-rotation", "Rotation between two stages, largest sd", (plan) => most(plan.triads.flatMap((triad) => triad.motion_sd_deg)), "deg", 2],
  ["motion-shift", "Shift between two stages, largest sd", (plan) => most(plan.triads.flatMap((triad) => triad.motion_sd_mm)), "mm", 3],
];

const GEOMETRY: readonly (readonly [string, string, (plan: AccuracyPlan) => number | null, string, number])[] = [
  ["baseline", "Baseline", ({ rig }) => rig.baseline_mm, "mm", 0],
  ["vergence", "Angle between the axes", ({ rig }) => rig.vergence_deg, "deg", 1],
  ["height", "Height of the cameras", ({ rig }) => rig.height_mm, "mm", 0],
  ["pixel", "Width of a pixel at the patient", ({ rig }) => rig.pixel_mm, "mm", 3],
  ["field", "Field of view along X", ({ rig }) => rig.pixel_mm * (rig.image_size_px[0] ?? 0), "mm", 0],
  ["ball", "Diameter of a ball in the image", ({ marker }) => marker.ball_px, "px", 1],
  ["difference", "Smallest difference of two distances", ({ marker }) => marker.difference_mm, "mm", 2],
  ["difference-sd", "Measured with an sd of", ({ marker }) => marker.difference_sd_mm, "mm", 3],
  ["neighbour", "Best wrong triplet with the next vertebra: error", ({ marker }) => marker.neighbour_mm, "mm", 2],
];

/** The figures of the designs. */
export function Results({ planned }: { planned: readonly Planned[] }): VNode {
  const outside = planned.flatMap(({ name, plan }) => [
    ...plan.triads.filter((triad) => !triad.in_view).map((triad) => `${name}: ${triad.vertebra}`),
    ...plan.depths.filter((depth) => !depth.in_view).map((depth) => `${name}: a triad ${fixed(depth.height_mm, 0)} mm high`),
  ]);
  return (
    <>
      {outside.length > 0 && (
        <p class="notice notice-warning" role="status">
          Not in both images, so that these deviations cannot be reached: {outside.join("; ")}
        </p>
      )}
      <section class="panel stack" aria-labelledby="accuracy-title">
        <header>
          <h2 id="accuracy-title">Expected accuracy</h2>
          <span class="muted small">largest over the vertebrae, one standard deviation</span>
        </header>
        <Comparison planned={planned} rows={FIGURES} caption={planned.map(({ name, plan }) => `${name}: ${plan.frame}`).join(" · ")} />
      </section>
      <section class="panel stack" aria-labelledby="geometry-title">
        <h2 id="geometry-title">Rig and marker</h2>
        <Comparison planned={planned} rows={GEOMETRY} caption="Where the optical axes meet; distances between the centres of balls" />
        <div class="row marker-drawings">
          {planned.map(({ name, plan }) => <MarkerDrawing key={name} name={name} marker={plan.marker} />)}
        </div>
      </section>
      <Depths planned={planned} />
      <Vertebrae planned={planned} />
    </>
  );
}

interface ComparisonProps {
  planned: readonly Planned[];
  rows: typeof FIGURES;
  caption: string;
}

function Comparison({ planned, rows, caption }: ComparisonProps): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label="Figures of the designs">
      <table class="comparison">
        <caption>{caption}</caption>
        <thead>
          <tr>
            <th scope="col">Figure</th>
            {planned.map(({ name }) => <th scope="col" class="number">Design {name}</th>)}
            {planned.length === 2 && <th scope="col" class="number">B / A</th>}
          </tr>
        </thead>
        <tbody>
          {rows.map(([key, label, value, unit, digits]) => {
            const values = planned.map(({ plan }) => value(plan));
            return (
              <tr>
                <th scope="row">{label}</th>
                {values.map((each, index) => (
                  <td class="number" data-plan={`${planned[index]?.name ?? ""}-${key}`}>{shown(each, unit, digits)}</td>
                ))}
                {planned.length === 2 && <td class="number muted">{ratio(values[0], values[1])}</td>}
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function Depths({ planned }: { planned: readonly Planned[] }): VNode {
  const xs = { A: heights(planned, "A"), B: heights(planned, "B") };
  const prefix = (name: Name, text: string): string => (planned.length === 2 ? `${name} ${text}` : text);
  const position: Line[] = planned.flatMap(({ name, plan }) => [
    ...[0, 1, 2].map((axis): Line => ({
      name: prefix(name, "XYZ"[axis] ?? ""),
      values: plan.depths.map((depth) => depth.position_sd_mm[axis] ?? null),
      style: (axis + 1) as 1 | 2 | 3,
      design: name,
    })),
  ]);
  const rotation: Line[] = planned.flatMap(({ name, plan }) =>
    [0, 1, 2].map((axis): Line => ({
      name: prefix(name, `about ${"xyz"[axis] ?? ""}`),
      values: plan.depths.map((depth) => depth.rotation_sd_deg[axis] ?? null),
      style: (axis + 1) as 1 | 2 | 3,
      design: name,
    })),
  );
  return (
    <section class="panel stack" aria-labelledby="depth-title">
      <header>
        <h2 id="depth-title">Over the depth</h2>
        <span class="muted small">height above the point where the axes meet, towards the cameras</span>
      </header>
      <div class="plots">
        <LinePlot title="Position, sd in mm along object axes" unit="mm" xLabel="height, mm" xs={xs} lines={position} />
        <LinePlot title="Rotation, sd in degrees about the triad’s axes" unit="degrees" xLabel="height, mm" xs={xs} lines={rotation} />
      </div>
      {planned.map(({ name, plan }) => (
        <div class="scroll-x" key={name} tabIndex={0} role="region" aria-label={`Design ${name} over the depth`}>
          <table>
            <caption>Design {name}: standard deviations of one level triad; the direction of the largest is a unit vector in object axes</caption>
            <thead>
              <tr>
                {["height, mm", "X, mm", "Y, mm", "Z, mm", "x, °", "y, °", "z, °", "largest, mm", "its direction", "pixel, mm", "in view"].map((head) => (
                  <th scope="col" class="number">{head}</th>
                ))}
              </tr>
            </thead>
            <tbody>
              {plan.depths.map((depth) => (
                <tr>
                  <th scope="row" class="number">{fixed(depth.height_mm, 0)}</th>
                  {depth.position_sd_mm.map((sd) => <td class="number">{fixed(sd, 3)}</td>)}
                  {depth.rotation_sd_deg.map((sd) => <td class="number">{fixed(sd, 2)}</td>)}
                  <td class="number">{fixed(depth.largest_sd_mm, 3)}</td>
                  <td class="number">({depth.largest_direction.map((part) => fixed(part, 2)).join(", ")})</td>
                  <td class="number">{fixed(depth.pixel_mm, 3)}</td>
                  <td class="number">{depth.in_view ? "yes" : "no"}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      ))}
    </section>
  );
}

function Vertebrae({ planned }: { planned: readonly Planned[] }): VNode {
  return (
    <section class="panel stack" aria-labelledby="vertebra-title">
      <h2 id="vertebra-title">By vertebra</h2>
      {planned.map(({ name, plan }) => (
        <div class="scroll-x" key={name} tabIndex={0} role="region" aria-label={`Design ${name} by vertebra`}>
          <table>
            <caption>{`Design ${name}: standard deviations; motion between two stages in the frame of ${plan.triads[0]?.vertebra ?? "the reference"}`}</caption>
            <thead>
              <tr>
                <th scope="col">Vertebra</th>
                {["X, mm", "Y, mm", "Z, mm", "in plane, °", "out of plane, °", "motion x, y, z, mm", "motion x, y, z, °", "in view"].map((head) => (
                  <th scope="col" class="number">{head}</th>
                ))}
              </tr>
            </thead>
            <tbody>
              {plan.triads.map((triad) => (
                <tr data-vertebra={`${name}-${triad.vertebra}`}>
                  <th scope="row">{triad.vertebra}</th>
                  {triad.position_sd_mm.map((sd) => <td class="number">{fixed(sd, 3)}</td>)}
                  <td class="number">{fixed(triad.in_plane_sd_deg, 2)}</td>
                  <td class="number">{fixed(triad.out_of_plane_sd_deg, 2)}</td>
                  <Motion values={triad.motion_sd_mm} digits={3} />
                  <Motion values={triad.motion_sd_deg} digits={2} />
                  <td class="number">{triad.in_view ? "yes" : "no"}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      ))}
    </section>
  );
}

function Motion({ values, digits }: { values: readonly (number | null)[]; digits: number }): VNode {
  if (values.every((value) => value === null)) {
    return (
      <td class="number muted" title="the frame is its own">
        <span aria-hidden="true">{DASH}</span>
        <span class="visually-hidden">none: the frame is its own</span>
      </td>
    );
  }
  return <td class="number">{values.map((value) => fixed(value, digits)).join("  ")}</td>;
}

/** The disparities of the designs' rigs. */
export function Disparities({ plans }: { plans: readonly { name: Name; plan: DisparityPlan }[] }): VNode {
  return (
    <section class="panel stack" aria-labelledby="disparity-title">
      <header>
        <h2 id="disparity-title">Disparity</h2>
        <span class="muted small">right less left pixel of the same point, over the field of view</span>
      </header>
      {plans.map(({ name, plan }) => (
        <div class="scroll-x" key={name} tabIndex={0} role="region" aria-label={`Disparities of design ${name}`}>
          <table>
            <caption>{`Design ${name}: u ${fixed(plan.u_px[0], 0)} to ${fixed(plan.u_px[1], 0)} px, v ${fixed(plan.v_px[0], 0)} to ${fixed(plan.v_px[1], 0)} px`}</caption>
            <thead>
              <tr>
                {["height, mm", "u mean, px", "u sd, px", "v mean, px", "v sd, px", "of the left image also in the right"].map((head) => (
                  <th scope="col" class="number">{head}</th>
                ))}
              </tr>
            </thead>
            <tbody>
              {plan.planes.map((plane) => (
                <tr>
                  <th scope="row" class="number">{fixed(plane.height_mm, 0)}</th>
                  <td class="number">{fixed(plane.mean_px[0], 1)}</td>
                  <td class="number">{fixed(plane.sd_px[0], 1)}</td>
                  <td class="number">{fixed(plane.mean_px[1], 1)}</td>
                  <td class="number">{fixed(plane.sd_px[1], 1)}</td>
                  <td class="number">{fixed(100 * plane.shown, 0)}%</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      ))}
    </section>
  );
}

function worst(plan: AccuracyPlan, axis: number): number | null {
  return most(plan.triads.map(({ position_sd_mm }) => position_sd_mm[axis] ?? null));
}

function most(values: readonly (number | null)[]): number | null {
  const known = values.filter((value) => value !== null);
  return known.length === 0 ? null : Math.max(...known);
}

function shown(value: number | null, unit: string, digits: number): string {
  return value === null ? DASH : withUnit(fixed(value, digits), unit);
}

function ratio(a: number | null | undefined, b: number | null | undefined): string {
  return a == null || b == null || a === 0 ? DASH : fixed(b / a, 2);
}

function heights(planned: readonly Planned[], wanted: Name): number[] {
  return planned.find(({ name }) => name === wanted)?.plan.depths.map(({ height_mm }) => height_mm) ?? [];
}
