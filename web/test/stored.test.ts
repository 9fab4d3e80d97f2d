import { expect, it } from "vitest";
import { planStored } from "../src/link/stored";
import type { ZeroFacts } from "../src/link/zero";

const SETTINGS = new Map([[27, "2"], [23, "0"], [110, "6000"], [111, "6000"], [112, "500"], [130, "300"], [131, "300"], [132, "80"]]);
const facts: ZeroFacts = { axisCount: 3, homed: "XYZ", machine_mm: [-150, -150, -40], offset_mm: [0, 0, 0], settings: SETTINGS };

it("lifts to the top less the pull-off, crosses, and lowers Z at the place", () => {
  expect(planStored("G28", [-100, -50, -10], facts)).toEqual({
    kind: "go",
    lines: ["$J=G53G21G90Z-2F500", "$J=G53G21G90X-100Y-50F12000", "$J=G53G21G90Z-10F500"],
    z_mm: -2,
  });
});

it("does not lower Z to the height at which it crosses", () => {
  const plan = planStored("G30", [-100, -50, -10], { ...facts, machine_mm: [-150, -150, -1] });
  expect(plan).toMatchObject({ lines: ["$J=G53G21G90X-100Y-50F12000", "$J=G53G21G90Z-10F500"], z_mm: null });
});

it.each([
  [[-100, -50, -10], { homed: "XY" }, /Home the machine first/],
  [[0, 0, 0], {}, /No position is stored for G28/],
  [undefined, {}, /No position is stored for G28/],
  [[-310, -50, -10], {}, /The X of G28 is at -310.000 mm/],
  [[-100, -50, -1], {}, /The Z of G28 is at -1.000 mm/], // within the pull-off of the switch
  [[-100, 5, -10], {}, /The Y of G28/],
] as const)("refuses %j", (place, other, why) => {
  expect(planStored("G28", place, { ...facts, ...other })).toMatchObject({ kind: "refuse", why: expect.stringMatching(why) as string });
});
