import { expect, test } from "vitest";
import { hasArrived, type Place } from "../src/link/arrival";

const at = (machine_mm: number[], origin_mm = [10, 0, -5], steps = "80"): Place => ({ machine_mm, origin_mm, settings: new Map([["100", steps], ["101", steps], ["102", steps]].map(([n, text]) => [Number(n), text!])) });

test.each([
  ["$J=G53G21G90X-20Y-30F1000", [0, 0, -5], [-20, -30, -5], true],
  ["$J=G53G21G90X-20Y-30F1000", [0, 0, -5], [-19.99, -30.01, -5], true], // whole steps
  ["$J=G53G21G90X-20Y-30F1000", [0, 0, -5], [-12.3, -18.5, -5], false], // Hold on the way
  ["$J=G53G21G90X-20Y-30F1000", [0, 0, -5], [0, 0, -5], false],
  ["$J=G21G90X0Y0F1000", [50, 50, 0], [10, 0, 0], true], // work zero
  ["$J=G21G90X0Y0F1000", [50, 50, 0], [0, 0, 0], false],
  ["$J=G21G91Z-5F600", [0, 0, -1], [0, 0, -6], true],
  ["$J=G21G91Z-5F600", [0, 0, -1], [0, 0, -3], false],
  ["M5", [0, 0, 0], [0, 0, 0], true],
  ["G53G1X1Y1F100", [0, 0, 0], [0, 0, 0], true], // held, not cancelled
])("%s from %j to %j: %s", (line, before, after, is) => {
  expect(hasArrived(line, at(before), at(after))).toBe(is);
});

test("a coarse axis ends within a step", () => {
  expect(hasArrived("$J=G21G91X1F600", at([0, 0, 0]), at([0.8, 0, 0], [0, 0, 0], "5"))).toBe(true);
  expect(hasArrived("$J=G21G91X1F600", at([0, 0, 0]), at([0.6, 0, 0], [0, 0, 0], "5"))).toBe(false);
});
