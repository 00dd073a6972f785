/** The page: frame and sign-in around what the address names. */
import type { VNode } from "preact";

import { session } from "../state/session";
import { Frame } from "./frame";
import { Page } from "./pages";
import { SignIn } from "./sign-in";

/** The whole page. */
export function App(): VNode {
  switch (session.value.state) {
    case "unknown":
      return <p class="starting" role="status">Spinewatch …</p>;
    case "out":
      return <SignIn problem={session.value.problem} />;
    case "in":
      return (
        <Frame>
          <Page />
        </Frame>
      );
  }
}
