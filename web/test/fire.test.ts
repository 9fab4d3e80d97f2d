import { expect, it } from "vitest";
import { darkLines, fireLine, noFire, noStages, usualStages } from "../src/link/fire";

const LASER = new Map([[32, "1"], [30, "1000"], [31, "0"], [89, "5"], [90, "30"]]);

it("lights in G1 with the part of $30", () => {
  expect(noFire(LASER, 5, 2)).toBe("");
  expect(fireLine(LASER, 5)).toBe("G94G1F100M3S50");
});

it.each([
  [new Map([...LASER, [32, "0"]]), 1, 1, /laser mode/],
  [new Map([...LASER, [89, "0"]]), 1, 1, /\$89/],
  [new Map([...LASER, [90, "0"]]), 1, 1, /\$90/],
  [LASER, 6, 1, /at most 5 %/],
  [LASER, 0, 1, /above 0/],
  [LASER, NaN, 1, /above 0/],
  [LASER, 1, 11, /at most 10 s/],
  [new Map([...LASER, [90, "3"]]), 1, 4, /at most 3 s/],
  [LASER, 1, NaN, /at most 10 s/],
] as const)("refuses", (settings, power, time, why) => expect(noFire(settings, power, time)).toMatch(why));

it("switches off before it restores the words of the program", () => {
  expect(darkLines("G0 G54 G17 G21 G90 G94 M5 M9 T0 F300 S200")).toEqual(["M5", "G0G94S200F300"]);
  expect(darkLines("G38.2 G54 G93 M5 F2 S0")).toEqual(["M5", "G0G93S0"]);
});

it("warms up within the range of the spindle", () => {
  const spindle = new Map([[32, "0"], [30, "24000"], [31, "8000"]]);
  expect(usualStages(spindle).map(({ rpm }) => rpm)).toEqual([8000, 12000, 24000]);
  expect(noStages(spindle, usualStages(spindle))).toBe("");
  expect(noStages(spindle, [{ rpm: 24001, time_s: 1 }])).toMatch(/24000/);
  expect(noStages(LASER, usualStages(LASER))).toMatch(/laser/);
});
