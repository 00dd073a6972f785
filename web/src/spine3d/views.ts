/** Where the spine is looked at from: an orthographic view with patient directions, orbit, zoom and fit. */
import { add, cross, dot, RADIANS, scale, subtract, type Vec3 } from "./vectors";

/** A view; lengths on the screen are the same at every depth, so that one scale bar holds everywhere. */
export interface View {
  /** Direction to the viewer: azimuth about cephalad from anterior towards left, and elevation, degrees. */
  readonly azimuth: number;
  readonly elevation: number;
  /** The point in the middle, mm, and the height that is seen, mm. */
  readonly centre: Vec3;
  readonly height: number;
}

export interface Basis {
  readonly right: Vec3;
  readonly up: Vec3;
  readonly toward: Vec3;
}

export interface Screen {
  readonly width: number;
  readonly height: number;
}

export type NamedView = "free" | "coronal" | "sagittal" | "top";

export const VIEWS: Readonly<Record<NamedView, { label: string; title: string; azimuth: number; elevation: number }>> = {
  free: { label: "Oblique", title: "Oblique, from behind on the right", azimuth: 215, elevation: 18 },
  coronal: { label: "Coronal", title: "Coronal, from behind", azimuth: 180, elevation: 0 },
  sagittal: { label: "Sagittal", title: "Sagittal, from the right", azimuth: 270, elevation: 0 },
  top: { label: "Top", title: "From above (head), anterior up", azimuth: 180, elevation: 90 },
};

export const DIRECTIONS: readonly { name: string; short: string; axis: Vec3 }[] = [
  { name: "anterior", short: "A", axis: [1, 0, 0] },
  { name: "posterior", short: "P", axis: [-1, 0, 0] },
  { name: "left", short: "L", axis: [0, 1, 0] },
  { name: "right", short: "R", axis: [0, -1, 0] },
  { name: "cephalad", short: "head", axis: [0, 0, 1] },
  { name: "caudad", short: "feet", axis: [0, 0, -1] },
];

const MIN_HEIGHT_MM = 20;
const MAX_HEIGHT_MM = 4000;

/** Right, up and toward the viewer of a view, patient axes. */
export function basisOf({ azimuth, elevation }: Pick<View, "azimuth" | "elevation">): Basis {
  const [a, e] = [azimuth * RADIANS, elevation * RADIANS];
  const toward: Vec3 = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  const up: Vec3 = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
  return { right: cross(up, toward), up, toward };
}

/** Turn the view by angles, degrees; over the head and under the feet it stops. */
export function orbit(view: View, turn: number, tilt: number): View {
  const azimuth = (((view.azimuth + turn) % 360) + 360) % 360;
  return { ...view, azimuth, elevation: Math.min(90, Math.max(-90, view.elevation + tilt)) };
}

/** Magnify by a factor about a point of the screen, px from its middle (right, up). */
export function zoom(view: View, factor: number, screen: Screen, about: readonly [number, number] = [0, 0]): View {
  const height = Math.min(MAX_HEIGHT_MM, Math.max(MIN_HEIGHT_MM, view.height / factor));
  const before = view.height / screen.height;
  const after = height / screen.height;
  return { ...pan(view, about[0] * (before - after), about[1] * (before - after)), height };
}

/** Move the middle by lengths on the screen to the right and up, mm. */
export function pan(view: View, rightMm: number, upMm: number): View {
  const { right, up } = basisOf(view);
  return { ...view, centre: add(view.centre, add(scale(right, rightMm), scale(up, upMm))) };
}

/** A ball that a picture shows whole: a vertebra with what sticks out of it. */
export interface Reach {
  readonly at: Vec3;
  readonly mm: number;
}

/** Room around the spine for labels, px. */
export const ROOM = { left: 90, right: 190, top: 34, bottom: 34 } as const;

/** The view in a direction that shows balls whole, and as much beside them on the right, mm, with room around. */
export function fit(
  direction: Pick<View, "azimuth" | "elevation">,
  shown: readonly Reach[],
  screen: Screen,
  besideMm = 0,
): View | null {
  if (shown.length === 0 || screen.width <= 0 || screen.height <= 0) return null;
  const { right, up, toward } = basisOf(direction);
  const [x, y, z] = [range(shown, right), range(shown, up), range(shown, toward)];
  const across = (x.high + besideMm - x.low) / Math.max(50, screen.width - ROOM.left - ROOM.right);
  const along = (y.high - y.low) / Math.max(50, screen.height - ROOM.top - ROOM.bottom);
  const mmPerPx = Math.max(across, along, MIN_HEIGHT_MM / screen.height);
  const middle = [
    scale(right, (x.low + x.high + besideMm + mmPerPx * (ROOM.right - ROOM.left)) / 2),
    scale(up, (y.low + y.high + mmPerPx * (ROOM.top - ROOM.bottom)) / 2),
    scale(toward, (z.low + z.high) / 2),
  ];
  return { ...direction, centre: middle.reduce(add, [0, 0, 0]), height: mmPerPx * screen.height };
}

/** Where balls begin and end along a direction, mm. */
export function range(shown: readonly Reach[], direction: Vec3): { low: number; high: number } {
  const places = shown.map(({ at, mm }) => ({ middle: dot(at, direction), mm }));
  return {
    low: Math.min(...places.map(({ middle, mm }) => middle - mm)),
    high: Math.max(...places.map(({ middle, mm }) => middle + mm)),
  };
}

/** Where a point is on the screen, px from its upper left corner; depth toward the viewer, mm. */
export function project(view: View, screen: Screen, point: Vec3): { x: number; y: number; depth: number } {
  const { right, up, toward } = basisOf(view);
  const from = subtract(point, view.centre);
  const pxPerMm = screen.height / view.height;
  return {
    x: screen.width / 2 + dot(right, from) * pxPerMm,
    y: screen.height / 2 - dot(up, from) * pxPerMm,
    depth: dot(toward, from),
  };
}

/** The point of the plane through the view's middle that a place on the screen shows. */
export function unproject(view: View, screen: Screen, x: number, y: number): Vec3 {
  const mmPerPx = view.height / screen.height;
  return pan(view, (x - screen.width / 2) * mmPerPx, (screen.height / 2 - y) * mmPerPx).centre;
}

/** The fixed view that a view looks along, or null for any other. */
export function namedView(view: View): NamedView | null {
  const names: NamedView[] = ["coronal", "sagittal", "top"];
  return (
    names.find((name) => {
      const { azimuth, elevation } = VIEWS[name];
      return Math.abs(azimuth - view.azimuth) < 0.01 && Math.abs(elevation - view.elevation) < 0.01;
    }) ?? null
  );
}

/** Names of the patient's directions at the edges of the screen; none where no direction is within 10 degrees of it. */
export function edgeNames(view: View): { left: string; right: string; top: string; bottom: string } {
  const { right, up } = basisOf(view);
  const near = (direction: Vec3): string =>
    DIRECTIONS.find(({ axis }) => dot(axis, direction) > Math.cos(10 * RADIANS))?.short ?? "";
  return { right: near(right), left: near(scale(right, -1)), top: near(up), bottom: near(scale(up, -1)) };
}

/** A round length for a scale bar of at most a seventh of the width, mm, and its length on the screen, px. */
export function scaleBar(view: View, screen: Screen): { mm: number; px: number } {
  const pxPerMm = screen.height / view.height;
  const most = Math.max(1e-6, screen.width / 7 / pxPerMm);
  const decade = 10 ** Math.floor(Math.log10(most));
  const mm = [5, 2, 1].map((step) => step * decade).find((length) => length <= most) ?? decade;
  return { mm, px: mm * pxPerMm };
}

/** In words, for those who do not see the picture. */
export function viewInWords(view: View): string {
  const name = namedView(view);
  if (name !== null) return VIEWS[name].title;
  const { toward } = basisOf(view);
  const parts = [...DIRECTIONS]
    .map(({ name: direction, axis }) => ({ direction, share: dot(axis, toward) }))
    .filter(({ share }) => share > 0.3)
    .sort((a, b) => b.share - a.share)
    .map(({ direction }) => direction);
  return `From ${parts.join(" and ")}`;
}
