import { expect, it } from "vitest";
import { placeLine, typedPosition, undoLine, workSystemOf } from "../src/link/offsets";

it("names a place, and has the line back to the offsets before", () => {
  expect(placeLine({ X: 0, Z: -1.25 })).toBe("G10L20P0X0Z-1.25");
  expect(undoLine("G55", ["X", "Z"], [1.5, 2, -30.0004])).toBe("G10L2P2X1.5Z-30.0004");
  expect(undoLine("G59.3", ["Y"], [0, -7, 0])).toBe("G10L2P9Y-7");
});

it("offers no way back to offsets that are not known", () => {
  expect(undoLine("G54", ["X"], undefined)).toBeNull();
  expect(undoLine("G54", ["A"], [0, 0, 0])).toBeNull();
  expect(undoLine("G53", ["X"], [0, 0, 0])).toBeNull();
});

it.each([
  ["12.5", false, 12.5],
  [" -0,25 ", false, -0.25],
  [".5", true, 12.7],
  ["1e3", false, null],
  ["", false, null],
  ["5-", false, null],
])("reads a typed position %j", (text, inInches, value) => expect(typedPosition(text, inInches)).toBe(value));

it("knows the work system among the modes", () => {
  expect(workSystemOf("G0 G59.2 G17 G21")).toBe("G59.2");
  expect(workSystemOf("")).toBe("G54");
});
