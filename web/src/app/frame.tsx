/** What is around every page: navigation, the state of the connection, who is signed in. */
import type { ComponentChildren, VNode } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { session, signOut } from "../state/session";
import { ConnectionBanner, ConnectionBadge } from "./connection";
import "./frame.css";
import { href, paths, type Route, route } from "./route";
import { ThemeButton } from "./theme-button";

const LINKS: readonly { label: string; path: string; pages: readonly Route["page"][] }[] = [
  { label: "Surgeries", path: paths.surgeries, pages: ["surgeries", "surgery", "images", "radiographs", "setup"] },
  { label: "Calibrations", path: paths.calibrations, pages: ["calibrations", "calibration"] },
  { label: "Planner", path: paths.planner, pages: ["planner"] },
];

/** The frame around a page. */
export function Frame({ children }: { children: ComponentChildren }): VNode {
  const main = useRef<HTMLElement>(null);
  useFocusOnNavigation(main);
  const identity = session.value.state === "in" ? session.value.identity : null;
  return (
    <>
      <a
        class="skip-link"
        href="#main"
        onClick={(event) => {
          event.preventDefault();
          focusHeading(main.current);
        }}
      >
        Skip to content
      </a>
      <header class="frame">
        <a class="frame-name" href={href(paths.surgeries)}>
          <img src="/icon.svg" alt="" width="28" height="28" />
          Spinewatch
        </a>
        <nav aria-label="Pages">
          {LINKS.map(({ label, path, pages }) => (
            <a href={href(path)} aria-current={pages.includes(route.value.page) ? "page" : undefined}>
              {label}
            </a>
          ))}
        </nav>
        <div class="frame-state">
          <ConnectionBadge />
          <ThemeButton />
          <span class="muted small frame-key" title={`key ${identity?.key ?? ""}`}>
            <span class="visually-hidden">Signed in with the key </span>
            {identity?.name}
          </span>
          <button type="button" class="button button-small" onClick={() => void signOut()}>
            Sign out
          </button>
        </div>
      </header>
      <ConnectionBanner />
      <main ref={main} id="main">
        {children}
      </main>
      <footer class="frame-foot muted small">
        <span>Lengths in mm, angles in degrees; patient axes: x anterior, y left, z cephalad. Intervals are 95%.</span>
        <span>
          Not a medical device. <a href="/docs">HTTP API</a>
        </span>
      </footer>
    </>
  );
}

/** Move the focus to the heading of a new page, as a browser does when it loads one. */
function useFocusOnNavigation(main: { readonly current: HTMLElement | null }): void {
  const { page } = route.value;
  const subject = "id" in route.value ? route.value.id : "";
  const first = useRef(true);
  useEffect(() => {
    if (first.current) {
      first.current = false;
      return undefined;
    }
    scrollTo(0, 0);
    return focusWhenThere(main.current);
  }, [page, subject]);
}

/** Focus the heading as soon as there is one: pages are loaded when they are first shown. */
function focusWhenThere(main: HTMLElement | null): () => void {
  if (main === null || focusHeading(main)) return () => undefined;
  const observer = new MutationObserver(() => {
    if (focusHeading(main)) observer.disconnect();
  });
  observer.observe(main, { childList: true, subtree: true });
  return () => observer.disconnect();
}

function focusHeading(main: HTMLElement | null): boolean {
  const heading = main?.querySelector<HTMLElement>("h1");
  if (!heading) return false;
  heading.tabIndex = -1;
  heading.focus();
  return true;
}
