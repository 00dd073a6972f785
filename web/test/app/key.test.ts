import { afterEach, expect, it } from "vitest";

import { takeKey } from "../../src/app/key";
import { route } from "../../src/app/route";

afterEach(() => history.replaceState(null, "", "/"));

it("takes the key out of the address, and shows the surgeries", () => {
  history.replaceState(null, "", "/#key=sw_aaaaaaaa_bbbb");
  expect(takeKey()).toBe("sw_aaaaaaaa_bbbb");
  expect(location.hash).toBe("#/");
  expect(route.value).toEqual({ page: "surgeries" });
  expect(takeKey()).toBeNull();
});

it.each(["#/surgeries/key=sw_a", "#key=<script>", ""])("finds none in %s", (hash) => {
  history.replaceState(null, "", `/${hash}`);
  expect(takeKey()).toBeNull();
});
