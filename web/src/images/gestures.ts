/** Mouse, pen and touch on an image: drag to pan, wheel and pinch to zoom, drag a mark to move it, click to choose. */
import type { RefObject } from "preact";
import { useEffect, useRef } from "preact/hooks";

import type { Vec2 } from "./vectors";

/** All places are screen px from the upper left corner of the element. */
export interface GestureActions {
  pan(by: Vec2): void;
  zoom(factor: number, at: Vec2): void;
  /** Whether a mark may be dragged. */
  mayDrag(key: string): boolean;
  drag(key: string, to: Vec2): void;
  /** A click on a mark, or beside all of them. */
  click(key: string | null, at: Vec2): void;
}

/** Movement, screen px, below which a press is a click. */
const CLICK_PX = 4;
const ZOOM_PER_WHEEL_PX = 0.0016;
const LINE_PX = 16;

interface Press {
  key: string | null;
  start: Vec2;
  /** From the pointer to the middle of the mark. */
  offset: Vec2;
  moved: boolean;
}

/** Listen to the gestures on an element whose marks have `data-key`, and `data-x` and `data-y` of their middle. */
export function useGestures(element: RefObject<HTMLElement | null>, actions: GestureActions): void {
  const latest = useRef(actions);
  latest.current = actions;
  useEffect(() => {
    const box = element.current;
    return box === null ? undefined : listen(box, () => latest.current);
  }, []);
}

function listen(box: HTMLElement, actions: () => GestureActions): () => void {
  const pointers = new Map<number, Vec2>();
  let press: Press | null = null;
  const placeOf = (event: MouseEvent): Vec2 => {
    const { left, top } = box.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const down = (event: PointerEvent): void => {
    if (event.button !== 0 && event.pointerType === "mouse") return;
    const at = placeOf(event);
    pointers.set(event.pointerId, at);
    box.setPointerCapture(event.pointerId);
    const mark = event.target instanceof Element ? event.target.closest<SVGElement>("[data-key]") : null;
    const middle: Vec2 = [Number(mark?.dataset["x"] ?? at[0]), Number(mark?.dataset["y"] ?? at[1])];
    press = {
      key: mark?.dataset["key"] ?? null,
      start: at,
      offset: [middle[0] - at[0], middle[1] - at[1]],
      moved: pointers.size > 1,
    };
  };
  const move = (event: PointerEvent): void => {
    const before = pointers.get(event.pointerId);
    if (before === undefined || press === null) return;
    const at = placeOf(event);
    pointers.set(event.pointerId, at);
    if (pointers.size === 2) {
      pinch(event.pointerId, before, at, pointers, actions());
      return;
    }
    press.moved ||= Math.hypot(at[0] - press.start[0], at[1] - press.start[1]) > CLICK_PX;
    if (!press.moved) return;
    if (press.key !== null && actions().mayDrag(press.key)) {
      actions().drag(press.key, [at[0] + press.offset[0], at[1] + press.offset[1]]);
    } else actions().pan([at[0] - before[0], at[1] - before[1]]);
  };
  const up = (event: PointerEvent): void => {
    if (!pointers.delete(event.pointerId)) return;
    if (press !== null && !press.moved && event.type === "pointerup") actions().click(press.key, placeOf(event));
    if (pointers.size === 0) press = null;
  };
  const wheel = (event: WheelEvent): void => {
    event.preventDefault();
    const delta = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
    actions().zoom(Math.exp(-delta * ZOOM_PER_WHEEL_PX), placeOf(event));
  };
  box.addEventListener("pointerdown", down);
  box.addEventListener("pointermove", move);
  box.addEventListener("pointerup", up);
  box.addEventListener("pointercancel", up);
  box.addEventListener("wheel", wheel, { passive: false });
  return () => {
    box.removeEventListener("pointerdown", down);
    box.removeEventListener("pointermove", move);
    box.removeEventListener("pointerup", up);
    box.removeEventListener("pointercancel", up);
    box.removeEventListener("wheel", wheel);
  };
}

function pinch(moving: number, before: Vec2, at: Vec2, pointers: ReadonlyMap<number, Vec2>, actions: GestureActions): void {
  for (const [pointer, fixed] of pointers) {
    if (pointer === moving) continue;
    const spread = Math.hypot(before[0] - fixed[0], before[1] - fixed[1]);
    const middle: Vec2 = [(at[0] + fixed[0]) / 2, (at[1] + fixed[1]) / 2];
    actions.pan([(at[0] - before[0]) / 2, (at[1] - before[1]) / 2]);
    if (spread > 0) actions.zoom(Math.hypot(at[0] - fixed[0], at[1] - fixed[1]) / spread, middle);
  }
}
