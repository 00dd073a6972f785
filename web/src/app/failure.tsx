/** Why something is not shown, and what to do. */
import type { VNode } from "preact";

import type { ProblemError } from "../api/client";

/** A problem as people read it, with the fields that cannot be used. */
export function Failure({ problem }: { problem: ProblemError }): VNode {
  return (
    <div class="failure" role="alert">
      <strong>{problem.title}</strong>
      <p>{problem.detail}</p>
      {problem.errors.length > 0 && (
        <ul>
          {problem.errors.map((error) => (
            <li>
              <code>{error.loc.slice(1).join(".")}</code>: {error.msg}
            </li>
          ))}
        </ul>
      )}
    </div>
  );
}
