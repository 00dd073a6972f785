/** One radiograph with its landmarks: zoom, pan, contrast, magnifier, and placing by mouse or keyboard. */
import type { VNode } from "preact";
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";

import { fixed } from "../format/numbers";
import type { Action, Editor } from "./editor";
import type { Band } from "./geometry";
import { actionOf } from "./keys";
import { type Point, pointAt, sameSlot, slotKey, slotLabel, slotsOf, VIEW_NAMES, type View } from "./landmarks";
import { Magnifier } from "./magnifier";
import { fit, panned, revealed, type Size, toImage, toScreen, type Viewport, zoomed } from "./viewport";

const DRAG_PX = 4;
const WHEEL = 0.0015;

interface FilmProps {
  view: View;
  source: string;
  size: Size;
  editor: Editor;
  band: Band | null;
  positiveOn: "left" | "right";
  dispatch: (action: Action) => void;
  onNext: (step: 1 | -1) => void;
}

/** A radiograph that landmarks are placed on. */
export function Film({ view, source, size, editor, band, positiveOn, dispatch, onNext }: FilmProps): VNode {
  const frame = useRef<HTMLDivElement>(null);
  const [window, setWindow] = useState<Size>({ width: 0, height: 0 });
  const [viewport, setViewport] = useState<Viewport | null>(null);
  const [cursor, setCursor] = useState<Point>([(size.width - 1) / 2, (size.height - 1) / 2]);
  const [pointed, setPointed] = useState<Point | null>(null);
  const [contrast, setContrast] = useState(100);
  const [brightness, setBrightness] = useState(100);
  const [failed, setFailed] = useState(false);
  const drag = useRef<{ x: number; y: number; moved: boolean } | null>(null);

  useLayoutEffect(() => {
    const element = frame.current;
    if (element === null) return undefined;
    const measure = (): void => setWindow({ width: element.clientWidth, height: element.clientHeight });
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (window.width > 0) setViewport((now) => now ?? fit(size, window));
  }, [window.width, window.height, size.width, size.height]);

  const { landmarks, selected } = editor;
  const isHere = selected?.view === view;
  const placed = isHere ? pointAt(landmarks, selected) : null;
  const target = placed ?? cursor;
  useEffect(() => {
    if (placed === null || viewport === null) return;
    setCursor(placed);
    setViewport(revealed(viewport, placed, window));
  }, [placed?.[0], placed?.[1], selected === null ? "" : slotKey(selected)]);

  const shown = viewport ?? { scale: 0.1, x: 0, y: 0 };
  const local = (event: MouseEvent): Point => {
    const box = frame.current?.getBoundingClientRect();
    return [event.clientX - (box?.left ?? 0), event.clientY - (box?.top ?? 0)];
  };
  const filter = `contrast(${contrast}%) brightness(${brightness}%)`;

  const onWheel = (event: WheelEvent): void => {
    event.preventDefault();
    setViewport(zoomed(shown, Math.exp(-event.deltaY * WHEEL), local(event), size, window));
  };
  const onPointerDown = (event: PointerEvent): void => {
    frame.current?.setPointerCapture(event.pointerId);
    drag.current = { x: event.clientX, y: event.clientY, moved: false };
  };
  const onPointerMove = (event: PointerEvent): void => {
    setPointed(toImage(shown, local(event)));
    const from = drag.current;
    if (from === null) return;
    const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
    if (!from.moved && Math.hypot(dx, dy) < DRAG_PX) return;
    drag.current = { x: event.clientX, y: event.clientY, moved: true };
    setViewport(panned(shown, dx, dy));
  };
  const onPointerUp = (event: PointerEvent): void => {
    const wasDrag = drag.current?.moved ?? true;
    drag.current = null;
    if (wasDrag) return;
    const near = nearest(local(event), shown, editor, view);
    if (near !== null && !(isHere && placed === null)) dispatch({ type: "select", slot: near });
    else if (isHere) place(toImage(shown, local(event)));
  };
  const place = (point: Point): void => {
    const [u, v] = point;
    if (u < -0.5 || v < -0.5 || u > size.width - 0.5 || v > size.height - 0.5) return;
    setCursor(point);
    dispatch({ type: "place", point });
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    const action = actionOf(event);
    if (action === null) return;
    event.preventDefault();
    const middle: Point = [window.width / 2, window.height / 2];
    switch (action.type) {
      case "move": {
        if (placed !== null) return dispatch({ type: "nudge", by: action.by });
        const moved: Point = [
          Math.min(size.width - 1, Math.max(0, cursor[0] + action.by[0])),
          Math.min(size.height - 1, Math.max(0, cursor[1] + action.by[1])),
        ];
        setCursor(moved);
        return setViewport(revealed(shown, moved, window));
      }
      case "place":
        return isHere ? (placed === null ? place(cursor) : onNext(1)) : undefined;
      case "next":
        return onNext(1);
      case "previous":
        return onNext(-1);
      case "zoom":
        return setViewport(zoomed(shown, action.factor, isHere ? toScreen(shown, target) : middle, size, window));
      case "fit":
        return setViewport(fit(size, window));
      default:
        return dispatch(action);
    }
  };

  const name = `${VIEW_NAMES[view]} radiograph`;
  const hint = isHere ? slotLabel(selected) : "the landmark that is placed now is in the other radiograph";
  return (
    <section class="film" aria-label={name}>
      <header class="film-head">
        <h2>{view === "pa" ? "PA" : "Lateral"}</h2>
        <label class="film-slider">
          Contrast
          <input type="range" min="50" max="300" step="5" value={contrast} onInput={(e) => setContrast(Number(e.currentTarget.value))} />
        </label>
        <label class="film-slider">
          Brightness
          <input type="range" min="40" max="250" step="5" value={brightness} onInput={(e) => setBrightness(Number(e.currentTarget.value))} />
        </label>
        <button type="button" class="button button-small" onClick={() => setViewport(fit(size, window))}>
          Whole image
        </button>
      </header>
      <div
        ref={frame}
        class={isHere ? "film-frame film-frame-active" : "film-frame"}
        role="application"
        tabIndex={0}
        aria-label={`${name}: ${hint}`}
        aria-describedby="film-keys"
        onWheel={onWheel}
        onPointerDown={onPointerDown}
        onPointerMove={onPointerMove}
        onPointerUp={onPointerUp}
        onPointerLeave={() => setPointed(null)}
        onKeyDown={onKeyDown}
      >
        <img
          src={source}
          alt=""
          draggable={false}
          onError={() => setFailed(true)}
          style={{
            filter,
            width: `${size.width}px`,
            height: `${size.height}px`,
            transform: `translate(${shown.x}px, ${shown.y}px) scale(${shown.scale})`,
            imageRendering: shown.scale > 3 ? "pixelated" : "auto",
          }}
        />
        <svg class="film-marks" width={window.width} height={window.height} aria-hidden="true">
          {band !== null && isHere && <BandMark band={band} viewport={shown} width={window.width} />}
          {slotsOf(landmarks)
            .filter((slot) => slot.view === view)
            .map((slot) => {
              const point = pointAt(landmarks, slot);
              if (point === null) return null;
              const [x, y] = toScreen(shown, point);
              const kind = slot.kind === "common" ? "common" : slot.name.startsWith("pedicle") ? "pedicle" : "corner";
              const state = sameSlot(slot, selected) ? "mark mark-selected" : "mark";
              return (
                <g class={`${state} mark-${kind}`} transform={`translate(${x} ${y})`} data-slot={slotKey(slot)}>
                  <MarkShape kind={kind} />
                </g>
              );
            })}
          <Outlines editor={editor} view={view} viewport={shown} />
          {isHere && placed === null && <Cross at={toScreen(shown, cursor)} />}
        </svg>
        <span class={`film-side film-side-${positiveOn}`}>{view === "pa" ? "L" : "A"}</span>
        <span class={`film-side film-side-${positiveOn === "left" ? "right" : "left"}`}>{view === "pa" ? "R" : "P"}</span>
        {isHere && <Magnifier source={source} size={size} centre={pointed ?? target} filter={filter} band={band} />}
        {failed && <p class="film-failed notice notice-error">The image cannot be shown. Load the page again.</p>}
      </div>
      <p class="film-foot small muted" aria-live="polite">
        {pointed === null ? `u ${fixed(target[0], 1)}  v ${fixed(target[1], 1)} px` : `u ${fixed(pointed[0], 1)}  v ${fixed(pointed[1], 1)} px`}
        {` · ${fixed(100 * shown.scale, 0)}%`}
        {isHere && band !== null && ` · ${band.subject}: v ${fixed(band.v, 1)} ± ${fixed(band.halfWidth, 1)} px (95%)`}
      </p>
    </section>
  );
}

function BandMark({ band, viewport, width }: { band: Band; viewport: Viewport; width: number }): VNode {
  const [, y] = toScreen(viewport, [0, band.v]);
  const half = Math.max(1, band.halfWidth * viewport.scale);
  return (
    <g class="band">
      <rect x={0} y={y - half} width={width} height={2 * half} />
      <line x1={0} x2={width} y1={y} y2={y} />
    </g>
  );
}

function MarkShape({ kind }: { kind: "common" | "pedicle" | "corner" }): VNode {
  if (kind === "common") return <path d="M0 -7L7 0L0 7L-7 0zM0 -2v4M-2 0h4" />;
  if (kind === "pedicle") return <path d="M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0M0 -2v4M-2 0h4" />;
  return <path d="M-6 0h12M0 -6v12" />;
}

function Cross({ at: [x, y] }: { at: Point }): VNode {
  return <path class="cursor" d={`M${x - 14} ${y}h10M${x + 4} ${y}h10M${x} ${y - 14}v10M${x} ${y + 4}v10`} />;
}

/** The bodies of vertebrae whose four corners are placed. */
function Outlines({ editor, view, viewport }: { editor: Editor; view: View; viewport: Viewport }): VNode {
  const [a, b] = view === "pa" ? ["left", "right"] : ["anterior", "posterior"];
  return (
    <>
      {editor.landmarks.vertebrae.map(({ vertebra, [view]: points }) => {
        const corners = [`superior_${a}`, `superior_${b}`, `inferior_${b}`, `inferior_${a}`].map((name) => points[name]);
        if (corners.some((corner) => corner === undefined)) return null;
        const screen = corners.map((corner) => toScreen(viewport, corner as Point));
        const [x, y] = [0, 1].map((axis) => screen.reduce((sum, each) => sum + (each[axis] ?? 0), 0) / 4);
        return (
          <g class="body" key={vertebra}>
            <polygon points={screen.map((each) => each.join(",")).join(" ")} />
            <text x={x} y={y}>{vertebra}</text>
          </g>
        );
      })}
    </>
  );
}

/** The placed landmark within reach of a click. */
function nearest([x, y]: Point, viewport: Viewport, editor: Editor, view: View) {
  const reach = 9;
  let best: { distance: number; slot: Editor["selected"] } = { distance: reach, slot: null };
  for (const slot of slotsOf(editor.landmarks)) {
    const point = slot.view === view ? pointAt(editor.landmarks, slot) : null;
    if (point === null) continue;
    const [px, py] = toScreen(viewport, point);
    const distance = Math.hypot(px - x, py - y);
    if (distance < best.distance) best = { distance, slot };
  }
  return best.slot;
}
