/** Parts that are loaded when they are first shown, so that the first page appears at once. */
import type { ComponentType, VNode } from "preact";
import { useEffect, useState } from "preact/hooks";

import { ProblemError } from "../api/client";
import { connection } from "../state/connection";
import { Failure } from "./failure";

/** Return a component that loads another one, and shows that, or that it cannot be loaded while there is no connection. */
export function lazy<P extends object>(load: () => Promise<ComponentType<P>>): ComponentType<P> {
  let loaded: ComponentType<P> | null = null;
  return function Lazy(props: P): VNode {
    const [content, setContent] = useState<{ part: ComponentType<P> | null; failed: boolean }>({ part: loaded, failed: false });
    const isBack = connection.value === "open";
    useEffect(() => {
      if (content.part !== null) return;
      load().then(
        (part) => {
          loaded = part;
          setContent({ part, failed: false });
        },
        () => setContent({ part: null, failed: true }),
      );
    }, [isBack]);
    if (content.part === null) {
      return content.failed ? <Failure problem={NOT_LOADED} /> : <p class="loading" role="status">Loading …</p>;
    }
    const Part = content.part;
    return <Part {...props} />;
  };
}

const NOT_LOADED = new ProblemError(0, "no-connection", "Part of the page not loaded", "It is loaded when the service answers again.");
