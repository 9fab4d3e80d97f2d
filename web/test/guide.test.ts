import { expect, test } from "vitest";
import { corrected, flipped, measure, readProgress, stepsPerMm } from "../src/link/guide";

test("steps per mm of a screw, a belt and a measurement", () => {
  expect(stepsPerMm(200, 16, 4)).toBe(800); // T8, two starts of 2 mm
  expect(stepsPerMm(200, 8, 20 * 2)).toBe(40); // GT2 with 20 teeth
  expect(corrected(800, 50, 25)).toBe(1600); // half as far: twice as many steps
});

test("the direction of one axis changes, and changes back", () => {
  expect(flipped(0, 2)).toBe(4);
  expect(flipped(flipped(5, 1), 1)).toBe(5);
});

test("measurements are numbers above zero, with either separator", () => {
  expect([measure("49,7"), measure(" 50 "), measure("0"), measure("-3"), measure(""), measure("5O")]).toEqual([49.7, 50, null, null, null, null]);
});

test("what another version has left is begun again", () => {
  expect(readProgress('{"step":2,"written":["a"]}', 6)).toEqual({ step: 2, written: ["a"] });
  for (const text of [null, "", "{", '{"step":9,"written":[]}', '{"step":1}']) expect(readProgress(text, 6)).toEqual({ step: 0, written: [] });
});
