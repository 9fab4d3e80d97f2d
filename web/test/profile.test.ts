import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { MACHINES, readProfile } from "../src/link/profile";
import { sendingOrder, SettingsFileError } from "../src/link/settingsfile";
import { readSettings } from "../src/link/settingsimport";

/** Of the command line: profile text, and the settings that it makes of it (tests/web/test_units.py). */
const oracle = process.env.WIFICNC_PROFILES;
const profiles = oracle ? (JSON.parse(readFileSync(oracle, "utf8")) as { name: string; text: string; values: Record<string, string> }[]) : [];

describe.skipIf(!oracle)("a profile has the settings that `wificnc settings import` makes of it", () => {
  it.each(profiles.map((profile) => [profile.name, profile] as const))("%s", async (_name, { text, values }) => {
    expect(Object.fromEntries(await readSettings(text))).toEqual(values);
  });
});

it("knows the profiles that come with WiFiCNC", () => {
  const shapeoko = MACHINES.find(({ id }) => id === "shapeoko3");
  expect(shapeoko?.name).toBe("Shapeoko 3");
  expect(Number(shapeoko?.values.get(130))).toBe(425);
});

const X = "[axis.x]\nsteps_per_mm = 40\nmax_rate_mm_min = 5000\nacceleration_mm_s2 = 400\n";

it.each([
  ["schema = 1\nname = 'm'\n", /at least one axis/],
  [`schema = 2\nname = 'm'\n${X}`, /schema must be 1/],
  ["schema = 1\nname = 'm'\n[axis.x]\nsteps_per_mm = 40\nmax_rate_mm_min = 5000\n", /axis\.x\.acceleration_mm_s2 is missing/],
  [`schema = 1\nname = 'm'\n${X}travel = 300\n`, /unknown key axis\.x\.travel/],
  [`schema = 1\nname = 'm'\n${X}[axis.q]\nsteps_per_mm = 1\n`, /unknown axis q/],
  [`schema = 1\nname = 'm'\n${X}[motor]\nfast = true\n`, /unknown table motor/],
  [`schema = 1\nname = 'm'\n${X}[limits]\nsoft = true\n`, /limits\.soft needs homing\.enabled.*limits\.soft needs axis\.x\.travel_mm/],
  [`schema = 1\nname = 'm'\n${X}[homing]\norder = ["Z", "X"]\n`, /homing\.order/],
  [`schema = 1\nname = 'm'\n${X}[homing]\nenabled = 1\n`, /homing\.enabled = 1: must be true or false/],
  [`schema = 1\nname = 'm'\n${X}home_at = "left"\n`, /axis\.x\.home_at must be/],
  [`schema = 1\nname = 'm'\n${X}second.driver = "x"\n`, /axis\.x\.second\.driver/],
  [`schema = 1\nname = 'm'\n${X.replace("= 40", "= -40")}`, /axis\.x\.steps_per_mm = -40/],
  [`schema = 1\nname = 'm'\n${X}[kinematics]\ntype = "cube"\n`, /kinematics\.type must be one of/],
])("refuses %j", (text, why) => {
  expect(() => readProfile(text)).toThrow(SettingsFileError);
  expect(() => readProfile(text)).toThrow(why);
});

it("gives a driver up before another axis gets it, and raises the laser's curve from its top", () => {
  const before = new Map([[210, "4"], [211, "0"], [94, "20"], [95, "40"], [22, "0"], [20, "0"]]);
  const after = new Map([[210, "0"], [211, "4"], [94, "50"], [95, "60"], [22, "1"], [20, "1"]]);
  expect(sendingOrder(after.keys(), before, after)).toEqual([22, 95, 94, 210, 20, 211]);
});
