/** Everything that the scene draws, as plain numbers: from bodies, triads, the plan and what is switched on. */
import type { Origin } from "../api/types";
import { STATUS } from "../format/status";
import { AXIS_COLOURS, blend, colourOf, dashOf, type Look, lookOf, type Palette, type Rgb, type Role, stageColour } from "./appearance";
import type { Body, Place } from "./bodies";
import { spineLine } from "./curve";
import { covarianceBlocks, type Ellipsoid, positionEllipsoid, tipEllipse } from "./ellipsoid";
import { ellipsoidMatrix, matrix4, type Matrix4, poseMatrix } from "./matrices";
import { matrixOfQuaternion, rotationTo } from "./rotations";
import type { DrawnTriad } from "./triads";
import { add, column, IDENTITY, length, scale, subtract, type Vec3 } from "./vectors";

export interface Switches {
  readonly shapes: boolean;
  readonly vectors: boolean;
  readonly triads: boolean;
  readonly line: boolean;
  /** The 95% regions are drawn so many times larger than they are; 0 draws none. */
  readonly regions: number;
}

export interface Solid {
  readonly matrix: Matrix4;
  readonly colour: Rgb;
  readonly opacity: number;
}

export interface Outline {
  readonly matrix: Matrix4;
  readonly colour: Rgb;
  readonly dash: readonly [number, number];
  readonly widthPx: number;
}

export interface Segment {
  readonly from: Vec3;
  readonly to: Vec3;
  readonly colour: Rgb;
  readonly dash: readonly [number, number];
  readonly widthPx: number;
  /** Length of the line before it, mm, so that dashes go on across segments. */
  readonly start: number;
}

/** The parts of a picture by the shape that they share. */
export interface Content {
  readonly vertebrae: readonly Solid[];
  readonly simpleBodies: readonly Solid[];
  readonly outlines: readonly Outline[];
  readonly bodyOutlines: readonly Outline[];
  readonly segments: readonly Segment[];
  /** Lines that nothing hides. */
  readonly curves: readonly Segment[];
  readonly cones: readonly Solid[];
  readonly balls: readonly Solid[];
  readonly ellipsoids: readonly Solid[];
  readonly circles: readonly Outline[];
  readonly planOutlines: readonly Outline[];
  readonly planSegments: readonly Segment[];
}

export interface Picture {
  readonly now: readonly Body[];
  readonly before: readonly Body[];
  readonly plan: readonly Body[];
  readonly stages: readonly (readonly Body[])[];
  readonly triads: readonly DrawnTriad[];
  readonly selected: string | null;
  readonly switches: Switches;
  readonly palette: Palette;
}

const BALL_RADIUS_MM = 4;
const FRAME_MM = 16;
const HEAD_MM: Vec3 = [2.6, 2.6, 7];
const NO_DASH = [1, 0] as const;

/** Lengths of a vertebra's vectors (anterior, left, cephalad), mm: each ends outside its body. */
export function vectorLengths([depth, width, height]: Vec3): Vec3 {
  return [depth / 2 + 18, width / 2 + 14, height / 2 + 12];
}

export function contentOf(picture: Picture): Content {
  const { now, before, plan, stages, switches, palette } = picture;
  const drawn = [...layer(now, "now", picture), ...layer(before, "before", picture)];
  const planned = layer(plan, "plan", picture);
  const withShapes = switches.shapes ? drawn : [];
  const vectors = switches.vectors ? drawn.map(({ body, role }) => vectorParts(body, role, palette)) : [];
  const planVectors = switches.vectors || !switches.shapes ? plan.map((body) => vectorParts(body, "plan", palette)) : [];
  const triads = switches.triads ? picture.triads.map((triad) => triadParts(triad, palette)) : [];
  const errors = switches.regions > 0 ? now.map((body) => errorParts(body, picture)) : [];
  const withLine = switches.line || !switches.shapes;
  return {
    vertebrae: withShapes.filter(({ look }) => look.opacity > 0).map(({ body, look }) => solid(body, look)),
    simpleBodies: switches.shapes ? stages.flatMap((bodies, k) => stageSolids(bodies, k, stages.length, palette)) : [],
    outlines: withShapes.filter(({ look }) => look.outline === "whole").map(({ body, look }) => outline(body, look)),
    bodyOutlines: withShapes.filter(({ look }) => look.outline === "body").map(({ body, look }) => outline(body, look)),
    segments: [
      ...vectors.flatMap((parts) => parts.segments),
      ...triads.flatMap((parts) => parts.segments),
    ],
    curves: [
      ...(withLine ? [...lineSegments(before, "before", palette), ...lineSegments(now, "now", palette)] : []),
      ...(switches.shapes ? [] : stages.flatMap((bodies, k) => stageLine(bodies, stageColour(k, stages.length, palette)))),
    ],
    cones: vectors.flatMap((parts) => parts.cones),
    balls: triads.flatMap((parts) => parts.balls),
    ellipsoids: errors.flatMap((parts) => parts.ellipsoids),
    circles: errors.flatMap((parts) => parts.circles),
    planOutlines: switches.shapes ? planned.map(({ body, look }) => outline(body, look)) : [],
    planSegments: [
      ...lineSegments(plan, "plan", palette),
      ...planVectors.flatMap((parts) => parts.segments),
    ],
  };
}

interface Drawn {
  readonly body: Body;
  readonly role: Role;
  readonly look: Look;
}

function layer(bodies: readonly Body[], role: Role, { palette, selected }: Picture): Drawn[] {
  return bodies.map((body) => ({
    body,
    role,
    look: lookOf(body.status, role, palette, role === "now" && body.level === selected),
  }));
}

function solid(body: Body, look: Look): Solid {
  return { matrix: poseMatrix(body, body.size), colour: look.fill, opacity: look.opacity };
}

function outline(body: Body, look: Look): Outline {
  return { matrix: poseMatrix(body, body.size), colour: look.edge, dash: look.dash, widthPx: look.widthPx };
}

function stageSolids(bodies: readonly Body[], index: number, count: number, palette: Palette): Solid[] {
  const colour = stageColour(index, count, palette);
  return bodies.map((body) => ({ matrix: poseMatrix(body, body.size), colour, opacity: 1 }));
}

function stageLine(bodies: readonly Body[], colour: Rgb): Segment[] {
  return bodies.slice(1).flatMap((to, k) => {
    const from = bodies[k];
    if (from === undefined || to.order - from.order !== 1) return [];
    return [{ from: from.position, to: to.position, colour, dash: NO_DASH, widthPx: 1.5, start: 0 }];
  });
}

function lineSegments(bodies: readonly Body[], role: Role, palette: Palette): Segment[] {
  const segments: Segment[] = [];
  let start = 0;
  for (const { from, to, points } of spineLine(bodies)) {
    const status = weakest(from.status, to.status);
    const colour = { now: "--text", before: "--muted", plan: "--good" }[role];
    points.slice(1).forEach((point, k) => {
      const last = points[k] ?? point;
      segments.push({
        from: last,
        to: point,
        colour: colourOf(palette, colour),
        dash: role === "plan" ? NO_DASH : dashOf(STATUS[status].dash),
        widthPx: role === "now" ? 2.4 : 1.6,
        start,
      });
      start += length(subtract(point, last));
    });
  }
  return segments;
}

function weakest(a: Origin, b: Origin): Origin {
  const order: readonly Origin[] = ["measured", "interpolated", "assumed", "not_measured"];
  return order.indexOf(a) > order.indexOf(b) ? a : b;
}

interface Parts {
  readonly segments: Segment[];
  readonly cones: Solid[];
}

/** Arrows of a pose's axes: anterior, left, cephalad. */
function vectorParts(body: Body, role: Role, palette: Palette): Parts {
  const dash = role === "plan" ? NO_DASH : dashOf(STATUS[body.status].dash);
  const colours = AXIS_COLOURS.map((name) => {
    if (role === "now") return colourOf(palette, name);
    return role === "plan" ? colourOf(palette, "--good") : blend(colourOf(palette, "--muted"), colourOf(palette, "--background"), 0.3);
  });
  return arrows(body, vectorLengths(body.size), colours, dash, role === "now" ? 2.6 : 1.5);
}

function arrows(
  place: Place,
  lengths: Vec3,
  colours: readonly Rgb[],
  dash: readonly [number, number],
  widthPx: number,
): Parts {
  const R = matrixOfQuaternion(place.rotation);
  const parts: Parts = { segments: [], cones: [] };
  for (const axis of [0, 1, 2] as const) {
    const direction = column(R, axis);
    const colour = colours[axis] ?? [1, 1, 1];
    const neck = add(place.position, scale(direction, lengths[axis] - HEAD_MM[2]));
    parts.segments.push({ from: place.position, to: neck, colour, dash, widthPx, start: 0 });
    parts.cones.push({ matrix: matrix4(rotationTo(direction), HEAD_MM, neck), colour, opacity: 1 });
  }
  return parts;
}

function triadParts(triad: DrawnTriad, palette: Palette): { segments: Segment[]; balls: Solid[] } {
  const [text, ground] = [colourOf(palette, "--text"), colourOf(palette, "--background")];
  const { place } = triad;
  const legs: Segment[] =
    place === null
      ? []
      : triad.balls.map(({ position, inBoth }) => ({
          from: place.position,
          to: position,
          colour: blend(text, ground, 0.35),
          dash: inBoth ? NO_DASH : [3, 3],
          widthPx: 2,
          start: 0,
        }));
  const frame = place === null ? [] : axisLines(place, palette);
  const balls = triad.balls.map(({ position, inBoth }) => ({
    matrix: matrix4(IDENTITY, [BALL_RADIUS_MM, BALL_RADIUS_MM, BALL_RADIUS_MM], position),
    colour: inBoth ? text : blend(text, ground, 0.6),
    opacity: 1,
  }));
  return { segments: [...legs, ...frame], balls };
}

function axisLines(place: Place, palette: Palette): Segment[] {
  const R = matrixOfQuaternion(place.rotation);
  return ([0, 1, 2] as const).map((axis) => ({
    from: place.position,
    to: add(place.position, scale(column(R, axis), FRAME_MM)),
    colour: colourOf(palette, AXIS_COLOURS[axis]),
    dash: NO_DASH,
    widthPx: 2,
    start: 0,
  }));
}

/** The 95% ellipsoid of the position, and 95% ellipses of the tips of the anterior and the cephalad vector. */
function errorParts(body: Body, { palette, selected, switches }: Picture): { ellipsoids: Solid[]; circles: Outline[] } {
  const isSelected = body.level === selected;
  const blocks = covarianceBlocks(body.covariance);
  const found = blocks && enlarged(positionEllipsoid(blocks.position), switches.regions);
  if (!blocks || !found) return { ellipsoids: [], circles: [] };
  const { colour: name, dash } = STATUS[body.status];
  const colour = isSelected ? colourOf(palette, "--focus") : colourOf(palette, name);
  const style = { colour, dash: dashOf(dash), widthPx: isSelected ? 2.4 : 1.4 };
  const { axes, radii } = found;
  const planes = [[0, 1, 2], [1, 2, 0], [2, 0, 1]] as const;
  const rings = planes.map(([a, b, c]) => {
    const columns = [column(axes, a), column(axes, b), column(axes, c)] as const;
    const turned = [0, 1, 2].map((r) => columns.map((vector) => vector[r as 0 | 1 | 2])) as unknown as typeof axes;
    return { matrix: matrix4(turned, [radii[a], radii[b], radii[c]], body.position), ...style };
  });
  const R = matrixOfQuaternion(body.rotation);
  const lengths = vectorLengths(body.size);
  const tips = ([0, 2] as const).flatMap((axis) => {
    const vector = scale(column(R, axis), lengths[axis]);
    const ellipse = enlarged(tipEllipse(vector, blocks.rotation), switches.regions);
    if (ellipse === null) return [];
    const edge = { ...style, colour: isSelected ? colour : colourOf(palette, AXIS_COLOURS[axis]) };
    return [{ matrix: ellipsoidMatrix(ellipse, add(body.position, vector)), ...edge }];
  });
  return {
    ellipsoids: [{ matrix: ellipsoidMatrix(found, body.position), colour, opacity: isSelected ? 0.34 : 0.2 }],
    circles: [...rings, ...tips],
  };
}

function enlarged(ellipsoid: Ellipsoid | null, times: number): Ellipsoid | null {
  return ellipsoid && { ...ellipsoid, radii: scale(ellipsoid.radii, times) };
}
