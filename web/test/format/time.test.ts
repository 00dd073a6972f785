import { describe, expect, it } from "vitest";

import { age, dayAndTime, duration } from "../../src/format/time";

describe("duration", () => {
  it.each([
    [-3, "0 s"],
    [42.9, "42 s"],
    [185, "3 min 5 s"],
    [7800, "2 h 10 min"],
    [280_000, "3 d 5 h"],
  ])("%s s is %s", (seconds, text) => {
    expect(duration(seconds)).toBe(text);
  });
});

describe("age", () => {
  it("is in seconds, null without a time", () => {
    expect(age("2026-11-21T09:30:00Z", Date.UTC(2026, 10, 21, 9, 31, 0))).toBe(60);
    expect(age(null, 0)).toBeNull();
    expect(age("no time", 0)).toBeNull();
  });
});

it("a time that is not known is a dash", () => {
  expect(dayAndTime(null)).toBe("–");
});
