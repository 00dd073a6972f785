/** A uPlot in the page: as wide as its place, drawn again when the theme changes. */
import type { VNode } from "preact";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { theme } from "../state/theme";
import { colour } from "./shapes";

export interface PlotProps {
  /** What the plot shows, for those who do not see it. */
  description: string;
  height: number;
  data: uPlot.AlignedData;
  /** Options but for size and colours of axes; called again for each theme. */
  options: () => Omit<uPlot.Options, "width" | "height">;
  /** Anything whose change needs new options. */
  version: string;
}

/** Draw a plot. */
export function Plot({ description, height, data, options, version }: PlotProps): VNode {
  const place = useRef<HTMLDivElement>(null);
  const shown = theme.value;
  useEffect(() => {
    const element = place.current;
    if (element === null) return undefined;
    const plot = new uPlot({ ...options(), width: widthOf(element), height }, data, element);
    const observer = new ResizeObserver(() => plot.setSize({ width: widthOf(element), height }));
    observer.observe(element);
    const print = matchMedia("print");
    const redraw = (): void => plot.redraw(false, true);
    print.addEventListener("change", redraw);
    return () => {
      observer.disconnect();
      print.removeEventListener("change", redraw);
      plot.destroy();
    };
  }, [shown, version, height]);
  return <div ref={place} class="plot" role="img" aria-label={description} />;
}

/** Axes as all plots have them. */
export function axisStyle(): Pick<uPlot.Axis, "stroke" | "font" | "grid" | "ticks"> {
  return {
    stroke: () => colour("--muted"),
    font: '12px system-ui, "Noto Sans", "DejaVu Sans", sans-serif',
    grid: { stroke: () => colour("--line"), width: 1 },
    ticks: { stroke: () => colour("--line"), width: 1, size: 4 },
  };
}

function widthOf(element: HTMLElement): number {
  return Math.max(120, element.clientWidth);
}
