import { describe, expect, it } from "vitest";
import { NOWHERE, standsAlike, type Standing } from "../src/job/standing";

const standing: Standing = {
  ...NOWHERE,
  settings: new Map([[110, "6000.000"]]),
  machine_mm: [20, 30, 10],
  offsets: new Map([["G55", [19, 28, 7]]]),
  origin_mm: [19, 28, 9],
  modes: "G0 G55 G17 G21 G90",
};

describe("a job is checked again", () => {
  it("not because the machine is elsewhere", () => {
    expect(standsAlike(standing, { ...standing, machine_mm: [0, 0, 0] })).toBe(true);
  });

  it("when work zero is reported later than the offsets that it is made of", () => {
    expect(standsAlike({ ...standing, origin_mm: [0, 0, 0] }, standing)).toBe(false);
  });

  it("when a setting, an offset or a mode is another one", () => {
    expect(standsAlike(standing, { ...standing, settings: new Map([[110, "5000.000"]]) })).toBe(false);
    expect(standsAlike(standing, { ...standing, offsets: new Map([["G55", [0, 0, 0]]]) })).toBe(false);
    expect(standsAlike(standing, { ...standing, modes: "G0 G54 G17 G21 G90" })).toBe(false);
  });
});
