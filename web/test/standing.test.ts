import { describe, expect, it } from "vitest";
import { NOWHERE, standsAlike, travelFindings, type Standing } from "../src/job/standing";

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

describe("a job fits the machine", () => {
  const machine: Standing = { ...standing, settings: new Map([["102", "80"], ["132", "80"]].map(([n, v]) => [Number(n), v!])), homed: "XYZ" };
  const findings = (low_mm: number, high_mm: number): number => travelFindings(machine, [0, 0, low_mm], [0, 0, high_mm]).length;

  it("when it goes to an end of the travel, which a motor meets to a step", () => {
    expect(findings(-80 - 1 / 80, 1 / 80)).toBe(0);
  });

  it("when its corners are rounded outside of the travel, as the junction deviation allows", () => {
    const settings = new Map([[11, "0.01"], [102, "1600"], [132, "80"]] as const);
    expect(travelFindings({ ...machine, settings }, [0, 0, -80.01], [0, 0, 0.0075])).toEqual([]);
    expect(travelFindings({ ...machine, settings }, [0, 0, -80.02], [0, 0, 0])).toHaveLength(1);
  });

  it("but not when it goes 0.1 mm further", () => {
    expect(findings(-80.1, 0)).toBe(1);
    expect(findings(-41, 0.1)).toBe(1);
  });
});
