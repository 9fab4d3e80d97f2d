import { describe, expect, it } from "vitest";
import { currentProblem, driversOf, scaledSteps, settingsAxis, spindlesOf } from "../src/link/drives";

// docs/drivers.md and $DRIVERS of the firmware
const OK = "[DRIVER:X|TMC2209|1|ok|800|957|50|16|27|120|0]";
const BAD = "[DRIVER:Y2|TMC5160|3|hot,open|1200|4596|50|256|16|7|2]";
const OFF = "[DRIVER:Z|TMC2130|0|left alone|0|1740|50|16|0|0|0]";

describe("rows of $DRIVERS", () => {
  it("are read with their problems", () => {
    expect(driversOf(["[MSG:x]", OK, BAD])).toEqual([
      { name: "X", chip: "TMC2209", place: 1, state: "verified", problems: [], current_ma: 800, most_ma: 957, hold_pct: 50, microsteps: 16, scale: 27, load: 120, resets: 0 },
      { name: "Y2", chip: "TMC5160", place: 3, state: "fault", problems: ["hot", "open"], current_ma: 1200, most_ma: 4596, hold_pct: 50, microsteps: 256, scale: 16, load: 7, resets: 2 },
    ]);
    expect(driversOf([OFF, OFF.replace("left alone", "wait")]).map(({ state }) => state)).toEqual(["unwritten", "written"]);
  });

  it("of an unknown form are left out", () => {
    for (const said of ["[DRIVER:X|TMC2209]", OK.replace("800", "x"), OK.replace("X|", "Q|"), `${OK}x`]) expect(driversOf([said])).toEqual([]);
  });
});

describe("the axis whose settings a driver has", () => {
  const none = new Map([["210", "0"]].map(([number, text]) => [Number(number), text!]));
  it("is its own", () => {
    expect(settingsAxis("Z", none)).toBe(2);
    expect(settingsAxis("Y2", none)).toBe(1);
  });
  it("is that which it is the second motor of ($210 ..)", () => {
    const second = new Map([[210, "0"], [211, "4"]]);
    expect(settingsAxis("A", second)).toBe(1);
    expect(settingsAxis("Y", second)).toBe(1);
  });
});

describe("a current", () => {
  it("is refused above that of the sense resistor, as the controller does", () => {
    expect(currentProblem("957", 957)).toBe("");
    expect(currentProblem("958", 957)).toContain("957 mA");
    expect(currentProblem("0", 957)).toBe("");
  });
});

it("microsteps and steps/mm change together, so that a mm stays one", () => {
  expect(scaledSteps("80.000", 16, 32)).toBe("160.000");
  expect(scaledSteps("320.000", 256, 1)).toBe("1.250");
});

describe("rows of $SPINDLES", () => {
  it("are read: number, the chosen one, whether it is a drive, name", () => {
    const said = ["[SPINDLE:0|-|0|DLV|PWM]", "[SPINDLE:2|0|2|*SDV|Huanyang HY, V1]", "[SPINDLE:x]"];
    expect(spindlesOf(said)).toEqual([
      { number: 0, chosen: false, drive: false, name: "PWM" },
      { number: 2, chosen: true, drive: true, name: "Huanyang HY, V1" },
    ]);
  });
});
