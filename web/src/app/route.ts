/** Pages by the fragment of the address: `#/surgeries/ID/stages/PRE/images`. */
import { signal } from "@preact/signals";

export type Route =
  | { page: "surgeries" }
  | { page: "surgery"; id: string; stage: string | null }
  | { page: "images"; id: string; stage: string }
  | { page: "radiographs"; id: string }
  | { page: "setup"; id: string }
  | { page: "calibrations" }
  | { page: "calibration"; id: string }
  | { page: "planner" }
  | { page: "unknown"; path: string };

/** Return the page of a path such as `/surgeries/ID`; what follows a question mark is the page's own. */
export function parse(path: string): Route {
  const unknown: Route = { page: "unknown", path };
  const parts = decoded(path.split("?")[0] ?? "");
  if (parts === null) return unknown;
  const [first, id, third, stage, fifth] = parts;
  if (parts.length === 0) return { page: "surgeries" };
  if (first === "planner" && parts.length === 1) return { page: "planner" };
  if (first === "calibrations" && parts.length <= 2) {
    return id === undefined ? { page: "calibrations" } : { page: "calibration", id };
  }
  if (first !== "surgeries" || id === undefined) return unknown;
  if (third === undefined) return { page: "surgery", id, stage: null };
  if (stage === undefined) return third === "radiographs" || third === "setup" ? { page: third, id } : unknown;
  if (third !== "stages" || parts.length > 5) return unknown;
  if (fifth === undefined) return { page: "surgery", id, stage };
  return fifth === "images" ? { page: "images", id, stage } : unknown;
}

/** Paths of the pages. */
export const paths = {
  surgeries: "/",
  surgery: (id: string): string => `/surgeries/${encodeURIComponent(id)}`,
  stage: (id: string, name: string): string => `${paths.surgery(id)}/stages/${encodeURIComponent(name)}`,
  images: (id: string, name: string): string => `${paths.stage(id, name)}/images`,
  radiographs: (id: string): string => `${paths.surgery(id)}/radiographs`,
  setup: (id: string): string => `${paths.surgery(id)}/setup`,
  calibrations: "/calibrations",
  calibration: (id: string): string => `/calibrations/${encodeURIComponent(id)}`,
  planner: "/planner",
} as const;

/** The page that is shown. */
export const route = signal<Route>(parse(current()));

addEventListener("hashchange", () => {
  route.value = parse(current());
});

/** Go to a page. */
export function navigate(path: string): void {
  location.hash = `#${path}`;
}

/** Go to a page in place of the one that the address names, which is then not in the history. */
export function replace(path: string): void {
  history.replaceState(null, "", `#${path}`);
  route.value = parse(path);
}

/** The address of a page, for links. */
export function href(path: string): string {
  return `#${path}`;
}

function current(): string {
  return location.hash.replace(/^#/, "").replace(/\?.*$/, ""); // what follows a ? belongs to the page
}

function decoded(path: string): string[] | null {
  try {
    return path
      .split("/")
      .filter((part) => part !== "")
      .map(decodeURIComponent);
  } catch {
    return null;
  }
}
