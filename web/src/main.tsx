/** The start of the page. */
import { render } from "preact";

import { followChanges } from "./api/follow";
import { App } from "./app/app";
import { takeKey } from "./app/key";
import { resume, signIn } from "./state/session";
import "./state/theme";

const key = takeKey();
void (key === null ? resume() : signIn(key));
followChanges();
addEventListener("hashchange", () => {
  const other = takeKey();
  if (other !== null) void signIn(other);
});

const page = document.getElementById("page");
if (page !== null) render(<App />, page);
