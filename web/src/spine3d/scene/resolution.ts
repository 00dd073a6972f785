/** How many pixels are drawn: fewer while the picture moves on a slow machine, all when it rests. */
import type { Screen } from "../views";

const MAX_RATIO = 2;
const MAX_PIXELS = 8_500_000;
/** Without a graphics processor a picture at rest is drawn within a tenth of a second. */
const SMOOTHED_PIXELS = 2_600_000;
const SLOW_MS = 30;
const FAST_MS = 15;
const REST_MS = 180;
const STEPS = [1, 0.75, 0.5] as const;

/** The pixels per CSS pixel that a screen of this size is drawn with while it moves on a fast machine. */
export function movingRatio(screen: Screen, devicePixelRatio: number): number {
  const byPixels = Math.sqrt(MAX_PIXELS / Math.max(1, screen.width * screen.height));
  return Math.min(MAX_RATIO, devicePixelRatio, byPixels);
}

/** The same at rest: without smoothing of edges by the graphics processor, more pixels than the screen's smooth them. */
export function restRatio(screen: Screen, devicePixelRatio: number, isSmoothed: boolean): number {
  const ratio = movingRatio(screen, devicePixelRatio);
  if (isSmoothed) return ratio;
  return Math.max(ratio, Math.min(MAX_RATIO, Math.sqrt(SMOOTHED_PIXELS / Math.max(1, screen.width * screen.height))));
}

/** Whether the step of a moving picture changes after a frame that took so long, ms. */
export function nextStep(step: number, frameMs: number): number {
  if (frameMs > SLOW_MS) return Math.min(STEPS.length - 1, step + 1);
  return frameMs < FAST_MS ? Math.max(0, step - 1) : step;
}

export class Resolution {
  private step = 0;
  private lastMs = 0;
  private isMoving = false;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly isSmoothed: boolean,
    private readonly whenAtRest: () => void,
  ) {}

  /** The picture moves. */
  moved(): void {
    this.isMoving = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.isMoving = false;
      this.lastMs = 0;
      this.whenAtRest();
    }, REST_MS);
  }

  /** The pixels per CSS pixel of the frame that is drawn now. */
  ratio(screen: Screen, devicePixelRatio: number): number {
    const now = performance.now();
    if (this.isMoving && this.lastMs > 0) this.step = nextStep(this.step, now - this.lastMs);
    this.lastMs = this.isMoving ? now : 0;
    if (!this.isMoving) return restRatio(screen, devicePixelRatio, this.isSmoothed);
    return movingRatio(screen, devicePixelRatio) * (STEPS[this.step] ?? 1);
  }

  stop(): void {
    clearTimeout(this.timer);
  }
}

/** Whether this browser draws without a graphics processor. */
export function isSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  const info = context?.getExtension("WEBGL_debug_renderer_info");
  const name: unknown = info ? context?.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(name));
}
