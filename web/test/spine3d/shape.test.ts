import { describe, expect, it } from "vitest";

import { prismShape, type Shape, vertebraShape } from "../../src/spine3d/shape";
import { bodySize } from "../../src/spine3d/size";
import { cross, dot, length, subtract, type Vec3 } from "../../src/spine3d/vectors";

function triangles({ positions, triangles: index }: Shape): [Vec3, Vec3, Vec3][] {
  const point = (k: number): Vec3 => [...positions.subarray(3 * k, 3 * k + 3)] as unknown as Vec3;
  return Array.from({ length: index.length / 3 }, (_, k) => [0, 1, 2].map((c) => point(index[3 * k + c] ?? 0)) as [Vec3, Vec3, Vec3]);
}

function volume(shape: Shape): number {
  return triangles(shape).reduce((sum, [a, b, c]) => sum + dot(a, cross(b, c)) / 6, 0);
}

describe("vertebraShape", () => {
  const shape = vertebraShape();

  it("is the vertebra of the exports", () => {
    // of exports.vertebra_mesh.vertebra(): number of triangles, area, volume and box
    const found = triangles(shape);
    expect(found).toHaveLength(180);
    const area = found.reduce((sum, [a, b, c]) => sum + length(cross(subtract(b, a), subtract(c, a))) / 2, 0);
    expect(area).toBeCloseTo(9.068430344, 5);
    expect(volume(shape)).toBeCloseTo(0.94281707, 5);
    const axis = (k: number): number[] => [...shape.positions].filter((_, index) => index % 3 === k);
    [[-1.56, 0.5], [-0.83, 0.83], [-0.79, 0.5]].forEach(([low = 0, high = 0], k) => {
      expect(Math.min(...axis(k))).toBeCloseTo(low, 5);
      expect(Math.max(...axis(k))).toBeCloseTo(high, 5);
    });
  });

  it("shares corners within a part", () => {
    expect(shape.positions.length / 3).toBe(3 * 16 + 2 + 7 * 8);
  });

  it("is outlined at its sharp edges only", () => {
    expect(shape.edges.length % 6).toBe(0);
    const isOfRing = (k: number): boolean => Math.abs(shape.bodyEdges[k + 2] ?? 0) === 0.5 && shape.bodyEdges[k + 2] === shape.bodyEdges[k + 5];
    const rings = Array.from({ length: shape.bodyEdges.length / 6 }, (_, k) => 6 * k).filter(isOfRing);
    expect(rings.length).toBeGreaterThanOrEqual(32);
    expect(shape.edges.length / 6).toBeLessThan(150);
  });
});

describe("prismShape", () => {
  it("is closed, faces outwards and has few triangles", () => {
    const shape = prismShape();
    expect(triangles(shape)).toHaveLength(20);
    expect(volume(shape)).toBeGreaterThan(0.5);
    const directions = triangles(shape).map(([a, b, c]) => dot(cross(subtract(b, a), subtract(c, a)), a));
    expect(Math.min(...directions)).toBeGreaterThan(0);
  });
});

describe("bodySize", () => {
  it("is that of the exports", () => {
    // of exports.vertebra_size.body_size_mm
    const expected: Record<string, Vec3> = {
      C1: [15, 18, 13],
      C7: [17.5714, 26.5714, 15.5714],
      T1: [18, 28, 16],
      T6: [25, 26, 19],
      T9: [28, 32, 21.5],
      T12: [31, 38, 24],
      L1: [32, 40.3333, 25],
      L5: [34, 48.3333, 27.6667],
      S1: [34, 50, 28],
      S5: [16.4, 26, 17.6],
    };
    for (const [level, size] of Object.entries(expected)) {
      bodySize(level).forEach((value, k) => expect(value, level).toBeCloseTo(size[k] ?? NaN, 3));
    }
  });
});
