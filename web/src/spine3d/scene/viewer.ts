/** The scene on a canvas: it is drawn when something changed, and only then. */
import {
  ColorManagement,
  ConeGeometry,
  LinearSRGBColorSpace,
  OrthographicCamera,
  Scene,
  ShaderMaterial,
  SphereGeometry,
  WebGLRenderer,
} from "three";

import type { Content } from "../content";
import { prismShape, vertebraShape } from "../shape";
import { scale } from "../vectors";
import { basisOf, type Screen, type View } from "../views";
import { lineMaterial, lineUniforms, MIDDLE_MM, solidMaterial } from "./materials";
import { Outlines, Segments, shapeGeometry, Solids } from "./parts";
import { isSoftware, Resolution } from "./resolution";

/** There is no WebGL in this browser. */
export class NoWebGLError extends Error {}

export class SpineViewer {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly lines = lineUniforms();
  private readonly resolution: Resolution;
  private readonly parts: Readonly<Record<keyof Content, { set: (items: never[]) => void }>>;
  private readonly plan: readonly (Outlines | Segments)[];
  private frame = 0;
  private screen: Screen = { width: 1, height: 1 };
  private view: View | null = null;
  private drawn = { width: 0, height: 0, ratio: 0 };
  private planShiftMm = 0;

  /** Raises `NoWebGLError` where the browser has none. */
  constructor(canvas: HTMLCanvasElement) {
    ColorManagement.enabled = false;
    const isSmoothed = !isSoftware();
    const context = canvas.getContext("webgl2", { antialias: isSmoothed, alpha: true, powerPreference: "low-power" });
    if (context === null) throw new NoWebGLError("this browser has no WebGL 2");
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setClearColor(0, 0);
    this.camera.matrixAutoUpdate = false;
    this.resolution = new Resolution(isSmoothed, () => this.invalidate());
    const [flat, flatClear, round] = [solidMaterial("flat"), solidMaterial("flat", true), solidMaterial("round")];
    const [line, topLine] = [lineMaterial(this.lines, true), lineMaterial(this.lines, false)];
    const topClear = solidMaterial("round", true);
    topClear.depthTest = false;
    const shape = vertebraShape();
    const vertebra = shapeGeometry(shape);
    const typicalMm = (edge: Float32Array): number =>
      Math.hypot(...[28, 38, 22].map((size, k) => size * ((edge[k + 3] ?? 0) - (edge[k] ?? 0))));
    const circleMm = (edge: Float32Array): number => 12 * Math.hypot((edge[3] ?? 0) - (edge[0] ?? 0), (edge[4] ?? 0) - (edge[1] ?? 0));
    const cone = new ConeGeometry(1, 1, 10).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    const made = {
      vertebrae: new SolidsBySight(new Solids(vertebra, flat, 0), new Solids(vertebra, flatClear, 3)),
      simpleBodies: new Solids(shapeGeometry(prismShape()), flat, 0),
      outlines: new Outlines(shape.edges, typicalMm, line, 1),
      bodyOutlines: new Outlines(shape.bodyEdges, typicalMm, line, 1),
      segments: new Segments(line, 1),
      curves: new Segments(topLine, 5),
      cones: new Solids(cone, round, 0),
      balls: new Solids(new SphereGeometry(1, 14, 10), round, 0),
      ellipsoids: new Solids(new SphereGeometry(1, 24, 16), topClear, 6),
      circles: new Outlines(circleEdges(48), circleMm, topLine, 7),
      planOutlines: new Outlines(shape.bodyEdges, typicalMm, line, 1),
      planSegments: new Segments(line, 1),
    };
    this.parts = made as unknown as typeof this.parts;
    this.plan = [made.planOutlines, made.planSegments];
    for (const part of Object.values(made)) {
      if (part instanceof SolidsBySight) this.scene.add(part.opaque.mesh, part.seeThrough.mesh);
      else this.scene.add(part.mesh);
    }
  }

  /** Show other things. */
  setContent(content: Content): void {
    for (const [name, part] of Object.entries(this.parts)) part.set(content[name as keyof Content] as never[]);
    this.resolution.moved();
    this.invalidate();
  }

  /** Look from elsewhere; the plan is drawn beside the spine, this far to the right on the screen. */
  setView(view: View, planShiftMm = 0): void {
    this.view = view;
    this.planShiftMm = planShiftMm;
    this.resolution.moved();
    this.invalidate();
  }

  setSize(screen: Screen): void {
    this.screen = screen;
    this.resolution.moved();
    this.invalidate();
  }

  /** Draw with the next frame of the browser. */
  invalidate(): void {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  /** Draw at once; before the browser prints. */
  draw(): void {
    const { view, screen } = this;
    if (view === null || screen.width < 2 || screen.height < 2) return;
    const ratio = this.resolution.ratio(screen, devicePixelRatio);
    this.resize(screen, ratio);
    this.lines.screen.value.set(screen.width, screen.height);
    this.lines.pxPerMm.value = screen.height / view.height;
    this.look(view, screen);
    this.renderer.render(this.scene, this.camera);
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.resolution.stop();
    this.scene.traverse((part) => {
      if (!("geometry" in part)) return;
      const { geometry, material } = part as unknown as { geometry: { dispose: () => void }; material: ShaderMaterial };
      geometry.dispose();
      material.dispose();
    });
    this.renderer.dispose();
  }

  /** Only when it changes: the browser makes new buffers each time. */
  private resize(screen: Screen, ratio: number): void {
    const { width, height, ratio: before } = this.drawn;
    if (width === screen.width && height === screen.height && ratio === before) return;
    this.drawn = { ...screen, ratio };
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(screen.width, screen.height, false);
  }

  private look(view: View, screen: Screen): void {
    const { right, up, toward } = basisOf(view);
    const eye = view.centre.map((x, k) => x + MIDDLE_MM * (toward[k] ?? 0)) as [number, number, number];
    this.camera.matrix.set(
      right[0], up[0], toward[0], eye[0],
      right[1], up[1], toward[1], eye[1],
      right[2], up[2], toward[2], eye[2],
      0, 0, 0, 1,
    );
    this.camera.matrixWorldNeedsUpdate = true;
    const half = view.height / 2;
    const across = (half * screen.width) / screen.height;
    Object.assign(this.camera, { left: -across, right: across, top: half, bottom: -half, near: 0, far: 2 * MIDDLE_MM });
    this.camera.updateProjectionMatrix();
    const shift = scale(right, this.planShiftMm);
    for (const part of this.plan) part.mesh.position.set(...shift);
  }
}

/** Solids that hide what is behind them, and see-through ones. */
class SolidsBySight {
  constructor(
    readonly opaque: Solids,
    readonly seeThrough: Solids,
  ) {}

  set(items: Parameters<Solids["set"]>[0]): void {
    this.opaque.set(items.filter(({ opacity }) => opacity >= 1));
    this.seeThrough.set(items.filter(({ opacity }) => opacity < 1));
  }
}

function circleEdges(sides: number): Float32Array {
  const point = (k: number): number[] => {
    const angle = (2 * Math.PI * k) / sides;
    return [Math.cos(angle), Math.sin(angle), 0];
  };
  return new Float32Array(Array.from({ length: sides }, (_, k) => [...point(k), ...point(k + 1)]).flat());
}
