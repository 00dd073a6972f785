/** The part that draws in three dimensions, loaded when it is first needed. */
import { useEffect, useRef, useState } from "preact/hooks";
import type { RefObject } from "preact";

import type { SpineViewer } from "./scene/viewer";

export type ViewerState =
  | { state: "loading" }
  | { state: "ready"; viewer: SpineViewer }
  /** No WebGL in the browser, its context was lost, or the part did not load. */
  | { state: "none"; reason: "no-webgl" | "lost" | "not-loaded" };

/** The viewer of a canvas, as long as that is on the page. */
export function useViewer(canvas: RefObject<HTMLCanvasElement | null>): ViewerState {
  const [state, setState] = useState<ViewerState>({ state: "loading" });
  const made = useRef<SpineViewer | null>(null);
  useEffect(() => {
    const element = canvas.current;
    if (element === null) return undefined;
    let isGone = false;
    const onLost = (event: Event): void => {
      // without this the browser never gives the context back
      event.preventDefault();
      setState({ state: "none", reason: "lost" });
    };
    const onRestored = (): void => {
      const viewer = made.current;
      if (viewer === null) return;
      setState({ state: "ready", viewer });
      viewer.invalidate();
    };
    element.addEventListener("webglcontextlost", onLost);
    element.addEventListener("webglcontextrestored", onRestored);
    import("./scene/viewer").then(
      ({ SpineViewer: Viewer }) => {
        if (isGone) return;
        try {
          made.current = new Viewer(element);
          setState({ state: "ready", viewer: made.current });
        } catch {
          setState({ state: "none", reason: "no-webgl" });
        }
      },
      () => !isGone && setState({ state: "none", reason: "not-loaded" }),
    );
    return () => {
      isGone = true;
      element.removeEventListener("webglcontextlost", onLost);
      element.removeEventListener("webglcontextrestored", onRestored);
      made.current?.dispose();
      made.current = null;
    };
  }, []);
  return state;
}
