/** Parts of the scene: each is one draw call for any number of things of one shape. */
import {
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  InstancedMesh,
  Mesh,
  type ShaderMaterial,
} from "three";

import type { Outline, Segment, Solid } from "../content";
import type { Shape } from "../shape";

/** Solids of one shape. */
export class Solids {
  readonly mesh: InstancedMesh<BufferGeometry, ShaderMaterial>;

  constructor(
    private readonly shape: BufferGeometry,
    material: ShaderMaterial,
    order: number,
  ) {
    this.mesh = instanced(shape, material, order);
  }

  set(items: readonly Solid[]): void {
    const colours = room(this.mesh, this.shape, items.length, [["colour", 4]]).colour;
    items.forEach(({ matrix, colour, opacity }, k) => {
      this.mesh.instanceMatrix.array.set(matrix, 16 * k);
      colours?.array.set([...colour, opacity], 4 * k);
    });
    changed(this.mesh, items.length);
  }
}

/** Outlines of one shape, from pairs of points. */
export class Outlines {
  readonly mesh: InstancedMesh<BufferGeometry, ShaderMaterial>;
  private readonly shape: BufferGeometry;

  constructor(edges: Float32Array, lengthsMm: (edge: Float32Array) => number, material: ShaderMaterial, order: number) {
    this.shape = edgeGeometry(edges, lengthsMm);
    this.mesh = instanced(this.shape, material, order);
  }

  set(items: readonly Outline[]): void {
    const { colour: colours, dash: dashes } = room(this.mesh, this.shape, items.length, [["colour", 4], ["dash", 2]]);
    items.forEach(({ matrix, colour, dash, widthPx }, k) => {
      this.mesh.instanceMatrix.array.set(matrix, 16 * k);
      colours?.array.set([...colour, widthPx], 4 * k);
      dashes?.array.set(dash, 2 * k);
    });
    changed(this.mesh, items.length);
  }
}

/** Single lines. */
export class Segments {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private capacity = 0;

  constructor(material: ShaderMaterial, order: number) {
    this.mesh = new Mesh(new InstancedBufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = order;
    this.mesh.visible = false;
  }

  set(items: readonly Segment[]): void {
    if (items.length > this.capacity) this.grow(items.length);
    const { from, to, start, colour, dash } = this.mesh.geometry.attributes;
    items.forEach((item, k) => {
      from?.array.set(item.from, 3 * k);
      to?.array.set(item.to, 3 * k);
      start?.array.set([item.start], k);
      colour?.array.set([...item.colour, item.widthPx], 4 * k);
      dash?.array.set(item.dash, 2 * k);
    });
    for (const attribute of [from, to, start, colour, dash]) if (attribute) attribute.needsUpdate = true;
    this.mesh.geometry.instanceCount = items.length;
    this.mesh.visible = items.length > 0;
  }

  private grow(count: number): void {
    this.capacity = 2 * count;
    this.mesh.geometry.dispose();
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(QUAD, 3));
    geometry.setIndex([0, 1, 2, 2, 1, 3]);
    for (const [name, size] of [["from", 3], ["to", 3], ["start", 1], ["colour", 4], ["dash", 2]] as const) {
      geometry.setAttribute(name, new InstancedBufferAttribute(new Float32Array(size * this.capacity), size));
    }
    this.mesh.geometry = geometry;
  }
}

/** Corners of a line: along 0 or 1, across -1 or 1. */
const QUAD = new Float32Array([0, -1, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0]);

/** The geometry of a shape. */
export function shapeGeometry({ positions, triangles }: Shape): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  return geometry;
}

function edgeGeometry(edges: Float32Array, lengthMm: (edge: Float32Array) => number): BufferGeometry {
  const count = edges.length / 6;
  const [corners, from, to, start] = [12, 12, 12, 4].map((size) => new Float32Array(size * count)) as [
    Float32Array,
    Float32Array,
    Float32Array,
    Float32Array,
  ];
  const index: number[] = [];
  let length = 0;
  for (let k = 0; k < count; k += 1) {
    corners.set(QUAD, 12 * k);
    for (let corner = 0; corner < 4; corner += 1) {
      from.set(edges.subarray(6 * k, 6 * k + 3), 12 * k + 3 * corner);
      to.set(edges.subarray(6 * k + 3, 6 * k + 6), 12 * k + 3 * corner);
      start[4 * k + corner] = length;
    }
    length += lengthMm(edges.subarray(6 * k, 6 * k + 6));
    index.push(...[0, 1, 2, 2, 1, 3].map((corner) => 4 * k + corner));
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(corners, 3));
  geometry.setAttribute("from", new BufferAttribute(from, 3));
  geometry.setAttribute("to", new BufferAttribute(to, 3));
  geometry.setAttribute("start", new BufferAttribute(start, 1));
  geometry.setIndex(index);
  return geometry;
}

function instanced(
  shape: BufferGeometry,
  material: ShaderMaterial,
  order: number,
): InstancedMesh<BufferGeometry, ShaderMaterial> {
  const mesh = new InstancedMesh(shape, material, 0);
  mesh.frustumCulled = false;
  mesh.renderOrder = order;
  mesh.visible = false;
  return mesh;
}

/** Make room for a number of instances; the attributes that differ between them are returned by name. */
function room(
  mesh: InstancedMesh<BufferGeometry, ShaderMaterial>,
  shape: BufferGeometry,
  count: number,
  attributes: readonly (readonly [string, number])[],
): Readonly<Record<string, InstancedBufferAttribute>> {
  if (count > mesh.instanceMatrix.count) {
    const capacity = 2 * count;
    // The shape's own attributes are shared; those of the instances are new.
    const geometry = new BufferGeometry().copy(shape);
    for (const [name, attribute] of Object.entries(shape.attributes)) geometry.setAttribute(name, attribute);
    if (shape.index) geometry.setIndex(shape.index);
    for (const [name, size] of attributes) {
      const values = new InstancedBufferAttribute(new Float32Array(size * capacity), size);
      geometry.setAttribute(name, values.setUsage(DynamicDrawUsage));
    }
    mesh.geometry = geometry;
    mesh.instanceMatrix = new InstancedBufferAttribute(new Float32Array(16 * capacity), 16).setUsage(DynamicDrawUsage);
  }
  const found = attributes.map(([name]) => [name, mesh.geometry.attributes[name] as InstancedBufferAttribute] as const);
  return Object.fromEntries(found);
}

function changed(mesh: InstancedMesh<BufferGeometry, ShaderMaterial>, count: number): void {
  mesh.count = count;
  mesh.visible = count > 0;
  mesh.instanceMatrix.needsUpdate = true;
  for (const attribute of Object.values(mesh.geometry.attributes)) {
    if (attribute instanceof InstancedBufferAttribute) attribute.needsUpdate = true;
  }
}
