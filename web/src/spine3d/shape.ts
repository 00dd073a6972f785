/**
 * The vertebra that is drawn: body, arch, spinous and transverse processes, so that its orientation shows. The same shape
 * as `exports/vertebra_mesh.py`, in vertebra axes (x anterior, y left, z cephalad), with a body of depth, width and height 1.
 */
import { cross, subtract, unit, type Vec3 } from "./vectors";

type Triangle = readonly [Vec3, Vec3, Vec3];
type Point2 = readonly [number, number];

/** Corners, triangles as indices of corners (counter-clockwise seen from outside), and the edges of the shape. */
export interface Shape {
  readonly positions: Float32Array;
  readonly triangles: Uint16Array;
  /** Sharp edges as pairs of points: of the whole shape, and of the body alone. */
  readonly edges: Float32Array;
  readonly bodyEdges: Float32Array;
}

const SIDES = 16;
const BACK_FLATTENED = 0.36;
const WAIST = 0.9;
/** An edge is outlined when the faces beside it differ by more than this, as the cosine. */
const SHARP = Math.cos((40 * Math.PI) / 180);
const QUADS = [
  [0, 1, 3, 2],
  [4, 6, 7, 5],
  [0, 4, 5, 1],
  [2, 3, 7, 6],
  [0, 2, 6, 4],
  [1, 5, 7, 3],
] as const;

/** Lines along the wall at the sides and in front, so that an outlined body looks like one. */
const WALL_LINES: (readonly [Vec3, Vec3])[] = [[0.08, 0.5], [0.08, -0.5], [0.5, 0]].flatMap(([x = 0, y = 0]) => [
  [[x, y, 0.5], [WAIST * x, WAIST * y, 0]],
  [[WAIST * x, WAIST * y, 0], [x, y, -0.5]],
]);

/** The vertebra of unit size. */
export function vertebraShape(): Shape {
  const parts: Triangle[][] = [body()];
  for (const side of [-1, 1]) {
    parts.push(box([-0.62, 0.26 * side, 0.18], [0.36, 0.12, 0.3]));
    parts.push(box([-0.92, 0.2 * side, 0.05], [0.28, 0.34, 0.55]));
    parts.push(box([-0.86, 0.58 * side, 0.16], [0.2, 0.5, 0.22], [-0.14, 0, 0]));
  }
  parts.push(box([-1.26, 0, -0.22], [0.6, 0.12, 0.42], [0, 0, -0.36]));
  return shape(parts);
}

/** A prism in place of a vertebra, of few triangles, for pictures with very many of them. */
export function prismShape(): Shape {
  const base: Point2[] = [[0.5, 0.22], [0, 0.5], [-0.5, 0.3], [-0.5, -0.3], [0, -0.5], [0.5, -0.22]];
  const [low, high] = [-0.5, 0.5].map((z) => base.map(([x, y]): Vec3 => [x, y, z])) as [Vec3[], Vec3[]];
  return shape([[...wall(base, -0.5, base, 0.5), ...fan(high), ...fan(low.reverse())]]);
}

/** Triangles of a plane polygon, counter-clockwise. */
function fan([first, ...others]: readonly Vec3[]): Triangle[] {
  return others.slice(1).map((point, k) => [first, others[k], point] as Triangle);
}

function shape(parts: readonly Triangle[][]): Shape {
  const corners = new Map<string, { index: number; point: Vec3 }>();
  const triangles = parts.flatMap((part, number) =>
    part.flatMap((triangle) =>
      triangle.map((point) => {
        // Corners of a part are shared, which spares a slow machine most of its work; parts only touch each other.
        const key = `${number} ${keyOf(point)}`;
        const corner = corners.get(key) ?? { index: corners.size, point };
        corners.set(key, corner);
        return corner.index;
      }),
    ),
  );
  return {
    positions: new Float32Array([...corners.values()].flatMap(({ point }) => [...point])),
    triangles: new Uint16Array(triangles),
    edges: new Float32Array(parts.flatMap(outline).flat(2)),
    bodyEdges: new Float32Array([...outline(parts[0] ?? []), ...WALL_LINES].flat(2)),
  };
}

function keyOf(point: Vec3): string {
  return point.map((x) => (Math.round(x * 1e5) / 1e5 + 0).toString()).join();
}

/** Three rings, the middle one narrower, flattened at the back. */
function body(): Triangle[] {
  const round = ring(SIDES, 0.5).map(([x, y]): Point2 => [Math.max(x, -BACK_FLATTENED), y]);
  const low = Math.min(...round.map(([x]) => x));
  const range = Math.max(...round.map(([x]) => x)) - low;
  const outer = round.map(([x, y]): Point2 => [(x - low) / range - 0.5, y]);
  const middle = outer.map(([x, y]): Point2 => [WAIST * x, WAIST * y]);
  return [...wall(outer, -0.5, middle, 0), ...wall(middle, 0, outer, 0.5), ...cap(outer, 0.5), ...cap(outer, -0.5)];
}

function ring(sides: number, radius: number): Point2[] {
  return Array.from({ length: sides }, (_, k): Point2 => {
    const angle = (2 * Math.PI * k) / sides;
    return [radius * Math.cos(angle), radius * Math.sin(angle)];
  });
}

function wall(low: readonly Point2[], bottom: number, high: readonly Point2[], top: number): Triangle[] {
  return low.flatMap((_, k): Triangle[] => {
    const [a, aNext] = [at(low, k, bottom), at(low, k + 1, bottom)];
    const [b, bNext] = [at(high, k, top), at(high, k + 1, top)];
    return [
      [a, aNext, bNext],
      [a, bNext, b],
    ];
  });
}

function cap(points: readonly Point2[], height: number): Triangle[] {
  const mean = (axis: 0 | 1): number => points.reduce((sum, point) => sum + point[axis], 0) / points.length;
  const centre: Vec3 = [mean(0), mean(1), height];
  return points.map((_, k): Triangle => {
    const [a, b] = [at(points, k, height), at(points, k + 1, height)];
    return height > 0 ? [centre, a, b] : [b, a, centre];
  });
}

function at(points: readonly Point2[], index: number, height: number): Vec3 {
  const [x, y] = points[index % points.length] ?? [0, 0];
  return [x, y, height];
}

/** A box whose far end, away from the body, is shifted. */
function box(centre: Vec3, size: Vec3, shear: Vec3 = [0, 0, 0]): Triangle[] {
  const corners = Array.from({ length: 8 }, (_, k): Vec3 => {
    const signs: Vec3 = [k & 4 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 1 ? 0.5 : -0.5];
    const isFar = centre[1] === 0 ? signs[0] < 0 : signs[1] * centre[1] > 0;
    return [0, 1, 2].map(
      (axis) => (centre[axis] ?? 0) + (signs[axis] ?? 0) * (size[axis] ?? 0) + (isFar ? (shear[axis] ?? 0) : 0),
    ) as unknown as Vec3;
  });
  return QUADS.flatMap((quad): Triangle[] => {
    const [a, b, c, d] = quad.map((k) => corners[k] ?? centre) as unknown as [Vec3, Vec3, Vec3, Vec3];
    return [
      [a, b, c],
      [a, c, d],
    ];
  });
}

function normal([a, b, c]: Triangle): Vec3 {
  return unit(cross(subtract(b, a), subtract(c, a)));
}

/** The sharp edges of a part: between two faces that differ much in direction. */
function outline(triangles: readonly Triangle[]): (readonly [Vec3, Vec3])[] {
  const found = new Map<string, { edge: readonly [Vec3, Vec3]; normals: Vec3[] }>();
  for (const corners of triangles) {
    for (const [a, b] of [[0, 1], [1, 2], [2, 0]] as const) {
      const edge = [corners[a], corners[b]] as const;
      const key = edge.map(keyOf).sort().join(" ");
      const entry = found.get(key) ?? { edge, normals: [] };
      entry.normals.push(normal(corners));
      found.set(key, entry);
    }
  }
  return [...found.values()]
    .filter(({ normals: [n, m] }) => n === undefined || m === undefined || n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < SHARP)
    .map(({ edge }) => edge);
}
