/** The way to work zero: what it may never do, over every place a machine can stand at. */
import { expect, it } from "vitest";
import { planZero, type ZeroFacts } from "../src/link/zero";

const SETTINGS = new Map(Object.entries({ 23: "0", 27: "3", 110: "6000", 111: "5000", 112: "800", 130: "300", 131: "200", 132: "80" }).map(([n, value]) => [Number(n), value]));
const FACTS: ZeroFacts = { axisCount: 3, homed: "XYZ", machine_mm: [-100, -100, -40], offset_mm: [-150, -120, -60], settings: SETTINGS };

it("lifts a homed machine to its top less the pull-off, then goes across", () =>
  expect(planZero(FACTS, null)).toEqual({ kind: "go", lines: ["$J=G53G21G90Z-3F800", "$J=G21G90X0Y0F11000"], z_mm: -3 }));

it("never moves Z down", () => {
  for (const z of [-3, -2.9, -1, 0, 4]) {
    const plan = planZero({ ...FACTS, machine_mm: [0, 0, z] }, null);
    expect(plan).toEqual({ kind: "go", lines: ["$J=G21G90X0Y0F11000"], z_mm: null });
  }
  expect(planZero({ ...FACTS, homed: "" }, -1).kind).toBe("refuse");
  expect(planZero({ ...FACTS, homed: "" }, NaN).kind).toBe("refuse");
});

it("asks when the machine is not homed, and lifts as far as it was told", () => {
  for (const homed of ["", "Z", "XY"]) expect(planZero({ ...FACTS, homed }, null)).toEqual({ kind: "ask" });
  expect(planZero({ ...FACTS, homed: "" }, 5)).toEqual({ kind: "go", lines: ["$J=G21G91Z5F800", "$J=G21G90X0Y0F11000"], z_mm: -35 });
  expect(planZero({ ...FACTS, homed: "" }, 0)).toEqual({ kind: "go", lines: ["$J=G21G90X0Y0F11000"], z_mm: null });
});

it.each([
  [[-298, -120, 0], true],
  [[-301, -120, 0], false],
  [[-2, -120, 0], false],
  [[-3, -199, 0], true],
  [[-3, 5, 0], false],
])("refuses a work zero outside of the travel or on a switch: %j", (offset_mm, reaches) =>
  expect(planZero({ ...FACTS, offset_mm }, null).kind).toBe(reaches ? "go" : "refuse"),
);

it("keeps off the switch at the other end when an axis homes there", () => {
  const settings = new Map(SETTINGS).set(23, "1");
  expect(planZero({ ...FACTS, settings, offset_mm: [-299, -120, 0] }, null).kind).toBe("refuse");
  expect(planZero({ ...FACTS, settings, offset_mm: [-1, -120, 0] }, null).kind).toBe("go");
});

it("needs to know where the machine is", () => {
  expect(planZero({ ...FACTS, offset_mm: [] }, null).kind).toBe("refuse");
  expect(planZero({ ...FACTS, axisCount: 2, machine_mm: [0, 0], homed: "" }, null)).toEqual({ kind: "go", lines: ["$J=G21G90X0Y0F11000"], z_mm: null });
});
