import { expect, it } from "vitest";
import { planFrame, type FramePlan, type FrameWish } from "../src/job/frame";
import { NOWHERE, type Standing } from "../src/job/standing";

const SETTINGS = { 30: "1000", 32: "0", 130: "300", 131: "200", 132: "80" };
const standing = (settings: Record<number, string> = {}, more: Partial<Standing> = {}): Standing => ({
  ...NOWHERE,
  settings: new Map(Object.entries({ ...SETTINGS, ...settings }).map(([n, value]) => [Number(n), value])),
  machine_mm: [-50, -60, -20],
  homed: "XYZ",
  modes: "G0 G54 G17 G20 G91 G94 M5 M9 T0 F500 S200",
  ...more,
});
const WISH: FrameWish = { feed_mm_min: 2000, lift_mm: 5, power_pct: 0 };
const [MIN, MAX] = [
  [-100, -90, -30],
  [-20, -40, -10],
];
const lines = (plan: FramePlan): string[] => (plan.kind === "go" ? plan.frame.lines : []);

it("goes once around with Z up, in moves that change no mode, and returns", () =>
  expect(lines(planFrame(standing(), MIN, MAX, WISH))).toEqual([
    "$J=G21G91Z5F600",
    "$J=G53G21G90X-100Y-90F2000",
    "$J=G53G21G90X-20Y-90F2000",
    "$J=G53G21G90X-20Y-40F2000",
    "$J=G53G21G90X-100Y-40F2000",
    "$J=G53G21G90X-100Y-90F2000",
    "$J=G53G21G90X-50Y-60F2000",
    "$J=G21G91Z-5F600",
  ]));

it("lights the laser around the outline only, at its share of $30, and puts the modes back", () => {
  const sent = lines(planFrame(standing({ 32: "1" }), MIN, MAX, { ...WISH, lift_mm: 0, power_pct: 1 }));
  expect(sent[1]).toBe("G21G90G94M4S10");
  expect(sent.slice(2, 6).every((line) => /^G53G1X-?\d+Y-?\d+F2000$/.test(line))).toBe(true);
  expect(sent.slice(6)).toEqual(["M5", "G0G20G91G94S200F500", "$J=G53G21G90X-50Y-60F2000"]);
});

it.each([
  ["outside of the travel", standing(), [-310, -90], WISH],
  ["a spindle instead of a laser", standing(), MIN, { ...WISH, power_pct: 1 }],
  ["a laser that would burn", standing({ 32: "1" }), MIN, { ...WISH, power_pct: 50 }],
  ["a lift that goes down", standing(), MIN, { ...WISH, lift_mm: -5 }],
  ["no number", standing(), MIN, { ...WISH, feed_mm_min: NaN }],
  ["an unknown place", NOWHERE, MIN, WISH],
])("refuses %s", (_, machine, low, wish) => expect(planFrame(machine, low, MAX, wish).kind).toBe("refuse"));

it("says that an axis which was not homed may leave its travel", () => {
  const plan = planFrame(standing({}, { homed: "YZ" }), [-310, -90], MAX, WISH);
  expect(plan.kind === "go" && plan.frame.notes).toEqual([expect.stringContaining("X: not homed")]);
});

it.each([
  [-2, ["$J=G21G91Z2F600", "$J=G21G91Z-2F600"], "Z lifts by 2.0 mm only"],
  [0, [], "Z lifts by 0.0 mm only"],
  [-5, ["$J=G21G91Z5F600", "$J=G21G91Z-5F600"], ""],
])("lifts from Z %d no further than the travel", (z_mm, lifts, note) => {
  const plan = planFrame(standing({}, { machine_mm: [-50, -60, z_mm] }), MIN, MAX, WISH);
  expect(lines(plan).filter((line) => line.includes("Z"))).toEqual(lifts);
  expect(plan.kind === "go" && plan.frame.notes.join()).toContain(note);
  expect(plan.kind === "go" && plan.frame.notes.length).toBe(note ? 1 : 0);
});

it("lifts as far as it is told where the travel is not known", () =>
  expect(lines(planFrame(standing({}, { machine_mm: [-50, -60, -2], homed: "XY" }), MIN, MAX, WISH))[0]).toBe("$J=G21G91Z5F600"));
