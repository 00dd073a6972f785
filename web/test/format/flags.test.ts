import { readFileSync } from "node:fs";

import { describe, expect, it } from "vitest";

import { CODES, flagName, severity, worst } from "../../src/format/flags";

const DOCUMENTED = [...readFileSync("../docs/flags.md", "utf-8").matchAll(/^\| `([a-z0-9-]+)` \|/gm)].map(
  ([, code]) => code,
);

describe("severity", () => {
  it("is known of every documented flag, once", () => {
    expect(DOCUMENTED.length).toBeGreaterThan(40);
    expect([...CODES].sort()).toEqual([...DOCUMENTED].sort());
  });

  it("of a flag of a later version is a warning", () => {
    expect(severity("something-new")).toBe("warning");
  });
});

describe("worst", () => {
  const flags = ["pixel-defect", "no-triads", "ball-occluded"].map((code) => ({ code, detail: "" }));

  it("is the most severe", () => {
    expect(worst(flags)?.code).toBe("no-triads");
    expect(worst([])).toBeNull();
  });
});

it("a code is read as words", () => {
  expect(flagName("ball-occluded")).toBe("Ball occluded");
});
