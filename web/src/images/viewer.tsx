/** One image with what is drawn over it; mouse, touch and keys move it and choose or edit ball centres. */
import type { RefObject, VNode } from "preact";
import { useRef } from "preact/hooks";

import { useGestures } from "./gestures";
import { Overlay, type OverlayProps } from "./overlay";
import { PictureCanvas } from "./picture-canvas";
import type { PictureState } from "./use-picture";
import type { Vec2 } from "./vectors";
import { keyAction } from "./viewer-keys";
import { toPixel, zoomed, panned, type View } from "./view";

export interface ViewerActions {
  show(view: View): void;
  fit(): void;
  /** Show all balls as large as possible. */
  frame(): void;
  /** Zoom in on the selected ball in both images. */
  centre(): void;
  select(key: string | null): void;
  /** Select the next or the previous mark. */
  step(by: 1 | -1): void;
  move(key: string, to: Vec2): void;
  nudge(by: Vec2): void;
  remove(): void;
  add(at: Vec2): void;
}

export interface ViewerProps extends OverlayProps {
  /** Measured by the page, because both views have the same size. */
  box?: RefObject<HTMLDivElement | null>;
  picture: PictureState;
  source: HTMLCanvasElement | null;
  download: string;
  leastZoom: number;
  editing: boolean;
  /** Whether the next click adds a ball centre. */
  adding: boolean;
  actions: ViewerActions;
}

/** One view. */
export function Viewer(props: ViewerProps): VNode {
  const own = useRef<HTMLDivElement>(null);
  const box = (props.box ?? own) as RefObject<HTMLDivElement | null>;
  const { side, view, size, actions, editing, adding, picture, scene } = props;
  const zoomAt = (factor: number, at: Vec2): void => actions.show(zoomed(view, size, factor, at, props.leastZoom));
  useGestures(box, {
    pan: (by) => actions.show(panned(view, by)),
    zoom: zoomAt,
    mayDrag: (key) => editing && !key.startsWith("b"),
    drag: (key, to) => actions.move(key, toPixel(view, size, side, to)),
    click: (key, at) => {
      if (editing && adding) actions.add(toPixel(view, size, side, at));
      else actions.select(key);
      focusMark(box.current, editing && adding ? null : key);
    },
  });
  const onKeyDown = (event: KeyboardEvent): void => {
    const action = keyAction(event, editing && props.selected !== null);
    if (action === null) return;
    event.preventDefault();
    if (action.kind === "pan") actions.show(panned(view, action.by));
    else if (action.kind === "zoom") zoomAt(action.factor, [size[0] / 2, size[1] / 2]);
    else if (action.kind === "nudge") actions.nudge(action.by);
    else if (action.kind === "fit") actions.fit();
    else if (action.kind === "frame") actions.frame();
    else if (action.kind === "centre") actions.centre();
    else if (action.kind === "details") document.getElementById("selection-heading")?.focus();
    else if (action.kind === "leave") {
      actions.select(null);
      box.current?.focus();
    } else if (action.kind === "remove") {
      if (editing) actions.remove();
    } else if (action.kind === "add") {
      if (editing) actions.add(toPixel(view, size, side, [size[0] / 2, size[1] / 2]));
    } else if (action.kind === "step") actions.step(action.by);
    if (action.kind === "step" || action.kind === "add") {
      requestAnimationFrame(() => requestAnimationFrame(() => focusMark(box.current, selectedKey(box.current))));
    }
  };
  return (
    <figure class="viewer-figure">
      <figcaption>
        <strong>{side === "left" ? "Left image" : "Right image"}</strong>
        <span class="muted small">{sizeText(props)}</span>
      </figcaption>
      <div
        ref={box}
        class={`viewer${editing && adding ? " is-adding" : ""}`}
        role="group"
        tabIndex={0}
        aria-label={`${side === "left" ? "Left" : "Right"} image`}
        aria-describedby="viewer-help"
        onKeyDown={onKeyDown}
        data-side={side}
        data-take={scene.take}
      >
        <PictureCanvas
          source={props.source}
          zoom={view.zoom}
          centre={view[side]}
          size={size}
          label={`Picture of the ${side} camera; its balls are in the table of balls`}
        />
        {size[0] > 0 && <Overlay {...props} />}
        {picture.state === "loading" && <p class="viewer-message" role="status">Loading the image …</p>}
        {picture.state === "failed" && (
          <p class="viewer-message" role="alert">
            {picture.message} <a href={props.download} download>Download the file</a>
          </p>
        )}
      </div>
    </figure>
  );
}

/** Focus the mark with a key, or the view itself. */
export function focusMark(box: HTMLElement | null, key: string | null): void {
  const marks = box?.querySelectorAll<SVGElement>("[data-key]") ?? [];
  const mark = [...marks].find((candidate) => candidate.dataset["key"] === key);
  if (mark === undefined) box?.focus();
  else mark.focus();
}

function selectedKey(box: HTMLElement | null): string | null {
  return box?.querySelector<SVGElement>("[aria-pressed=true]")?.dataset["key"] ?? null;
}

function sizeText({ picture, camera, view }: ViewerProps): string {
  const [width, height] = camera.size;
  const bits = picture.state === "ready" ? `, ${picture.picture.bits} bits` : "";
  return `${width} × ${height} px${bits}; ${Math.round(view.zoom * 100)}%`;
}
