/** Shapes of a status and colours of the page, drawn on a canvas. */
import { STATUS, type Status } from "../format/status";

/** Return the value of a custom property of the page, such as `--accent`. */
export function colour(property: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(property).trim();
}

/** Draw the shape of a status around a point; lengths in pixels of the canvas. */
export function drawStatus(context: CanvasRenderingContext2D, status: Status, x: number, y: number, radius: number): void {
  const { shape, filled, colour: property } = STATUS[status];
  const path = new Path2D();
  switch (shape) {
    case "circle":
      path.arc(x, y, radius, 0, 2 * Math.PI);
      break;
    case "diamond":
      polygon(path, [[x, y - radius * 1.25], [x + radius * 1.25, y], [x, y + radius * 1.25], [x - radius * 1.25, y]]);
      break;
    case "triangle":
      polygon(path, [[x, y - radius * 1.2], [x + radius * 1.15, y + radius * 0.9], [x - radius * 1.15, y + radius * 0.9]]);
      break;
    case "bracket":
      for (const sign of [-1, 1]) {
        path.moveTo(x + sign * radius * 0.4, y - radius);
        path.lineTo(x + sign * radius, y - radius);
        path.lineTo(x + sign * radius, y + radius);
        path.lineTo(x + sign * radius * 0.4, y + radius);
      }
      break;
    case "cross":
      for (const sign of [-1, 1]) {
        path.moveTo(x - radius, y - sign * radius);
        path.lineTo(x + radius, y + sign * radius);
      }
      break;
  }
  context.setLineDash([]);
  context.lineWidth = Math.max(1.5, radius * 0.4);
  context.strokeStyle = colour(property);
  if (shape !== "cross" && shape !== "bracket") {
    context.fillStyle = filled ? colour(property) : colour("--surface");
    context.fill(path);
  }
  context.stroke(path);
}

function polygon(path: Path2D, corners: readonly (readonly [number, number])[]): void {
  corners.forEach(([x, y], i) => (i === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
  path.closePath();
}
