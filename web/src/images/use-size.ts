/** The size of an element on the screen. */
import type { RefObject } from "preact";
import { useLayoutEffect, useState } from "preact/hooks";

import type { Vec2 } from "./vectors";

/** Width and height of an element, screen px; it follows the element. */
export function useSize(element: RefObject<HTMLElement | null>): Vec2 {
  const [size, setSize] = useState<Vec2>([0, 0]);
  useLayoutEffect(() => {
    const box = element.current;
    if (box === null) return undefined;
    const measure = (): void =>
      setSize((before) =>
        before[0] === box.clientWidth && before[1] === box.clientHeight ? before : [box.clientWidth, box.clientHeight],
      );
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(box);
    return () => observer.disconnect();
  }, []);
  return size;
}
