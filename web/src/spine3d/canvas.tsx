/** The canvas with its mouse, touch and keyboard. */
import { type Signal, useSignal } from "@preact/signals";
import type { ComponentChildren, VNode } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { theme } from "../state/theme";
import type { Palette } from "./appearance";
import type { Content } from "./content";
import { type Command, dragged, keyed, KEY_HELP, pinched, type Point, wheeled } from "./gestures";
import { useViewer, type ViewerState } from "./load";
import { readPalette } from "./palette";
import type { Screen, View } from "./views";

interface CanvasProps {
  content: Content | null;
  view: Signal<View | null>;
  screen: Signal<Screen>;
  palette: Signal<Palette>;
  planShiftMm: number;
  label: string;
  onCommand: (command: Command) => void;
  /** A click at a place, px from the upper left corner. */
  onPick: (x: number, y: number) => void;
  children: ComponentChildren;
}

const CLICK_PX = 5;

export function SpineCanvas(props: CanvasProps): VNode {
  const { content, view, screen, palette, planShiftMm } = props;
  const area = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const drawing = useViewer(canvas);
  const viewer = drawing.state === "ready" ? drawing.viewer : null;
  const pointers = usePointers(props, area);

  useEffect(() => {
    const element = area.current;
    if (element === null) return undefined;
    const observer = new ResizeObserver(() => {
      screen.value = { width: element.clientWidth, height: element.clientHeight };
    });
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  useEffect(() => {
    // after the theme's own effect has changed the document
    const timer = setTimeout(() => area.current && (palette.value = readPalette(area.current)));
    return () => clearTimeout(timer);
  }, [theme.value]);

  useEffect(() => viewer?.setSize(screen.value), [viewer, screen.value]);
  useEffect(() => {
    if (viewer && content) viewer.setContent(content);
  }, [viewer, content]);
  useEffect(() => {
    if (viewer && view.value) viewer.setView(view.value, planShiftMm);
  }, [viewer, view.value, planShiftMm]);
  useEffect(() => {
    const print = (): void => viewer?.draw();
    addEventListener("beforeprint", print);
    return () => removeEventListener("beforeprint", print);
  }, [viewer]);

  const onKeyDown = (event: KeyboardEvent): void => {
    if (view.value === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const meant = keyed(view.value, event.key, event.shiftKey);
    if (meant === null) return;
    event.preventDefault();
    if (typeof meant === "string") props.onCommand(meant);
    else view.value = meant;
  };

  return (
    <div class="spine-area">
      <div
        ref={area}
        class="spine-canvas"
        role="application"
        aria-roledescription="3D view"
        aria-label={props.label}
        aria-description={KEY_HELP}
        tabIndex={0}
        onKeyDown={onKeyDown}
        {...pointers}
      >
        <canvas ref={canvas} aria-hidden="true" hidden={drawing.state === "none"} />
        {drawing.state === "ready" && props.children}
      </div>
      {drawing.state !== "ready" && <Instead drawing={drawing} />}
    </div>
  );
}

function Instead({ drawing }: { drawing: Exclude<ViewerState, { state: "ready" }> }): VNode {
  if (drawing.state === "loading") {
    return (
      <p class="spine-instead muted" role="status">
        Loading the 3D view …
      </p>
    );
  }
  const texts = {
    "no-webgl": "This browser cannot draw in three dimensions (WebGL 2 is missing or switched off).",
    lost: "The graphics processor stopped drawing. The view comes back by itself when it is free again.",
    "not-loaded": "The 3D view did not load. Check the network, and load the page again.",
  };
  return (
    <div class="spine-instead" role="status">
      <div class="notice notice-warning">
        <strong>No 3D view</strong>
        <p>{texts[drawing.reason]}</p>
        <p>The same data are in the table of the vertebrae and in the measures.</p>
      </div>
    </div>
  );
}

/** Handlers of the pointers: one turns or moves, two zoom, a click picks. */
function usePointers(
  { view, screen, onPick }: CanvasProps,
  area: { readonly current: HTMLDivElement | null },
): Record<string, (event: PointerEvent) => void> {
  const down = useRef(new Map<number, Point>());
  const travelled = useRef(0);
  const isDragging = useSignal(false);
  const place = (event: PointerEvent | WheelEvent): Point => {
    const box = area.current?.getBoundingClientRect();
    return [event.clientX - (box?.left ?? 0), event.clientY - (box?.top ?? 0)];
  };

  useEffect(() => {
    const element = area.current;
    if (element === null) return undefined;
    const onWheel = (event: WheelEvent): void => {
      // A page that is scrolled past the picture stays scrollable: the wheel zooms only what was chosen before.
      if (view.value === null || (document.activeElement !== element && !event.ctrlKey)) return;
      event.preventDefault();
      const px = event.deltaMode === 1 ? 18 * event.deltaY : event.deltaY;
      view.value = wheeled(view.value, screen.value, px, place(event));
    };
    element.addEventListener("wheel", onWheel, { passive: false });
    return () => element.removeEventListener("wheel", onWheel);
  }, []);

  const end = (event: PointerEvent): void => {
    down.current.delete(event.pointerId);
    isDragging.value = down.current.size > 0;
  };
  return {
    onPointerDown: (event) => {
      area.current?.focus({ preventScroll: true });
      area.current?.setPointerCapture(event.pointerId);
      if (down.current.size === 0) travelled.current = 0;
      down.current.set(event.pointerId, place(event));
      isDragging.value = true;
    },
    onPointerMove: (event) => {
      const before = down.current.get(event.pointerId);
      if (before === undefined || view.value === null) return;
      const now = place(event);
      const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      travelled.current += Math.hypot(dx, dy);
      const other = [...down.current].find(([id]) => id !== event.pointerId)?.[1];
      down.current.set(event.pointerId, now);
      if (other !== undefined) view.value = pinched(view.value, screen.value, [before, other], [now, other]);
      else if (travelled.current > CLICK_PX) {
        view.value = dragged(view.value, screen.value, dx, dy, event.shiftKey || (event.buttons & 6) !== 0);
      }
    },
    onPointerUp: (event) => {
      const isClick = travelled.current <= CLICK_PX && down.current.size === 1 && event.button === 0;
      end(event);
      if (isClick) onPick(...place(event));
    },
    onPointerCancel: end,
    onContextMenu: (event) => event.preventDefault(),
  };
}
