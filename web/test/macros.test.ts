import { expect, it } from "vitest";
import { macroLines, macroMoves, readMacros } from "../src/link/macros";

const macro = (lines: string): { name: string; lines: string } => ({ name: "m", lines });

it.each(["G0X1", "g1 z-2 f100", "G28", "$H", "$J=G91X1F100", "M6T1", "M0", "X5", "G38.2Z-10F50", "G53Z0", "A90", "G5.1X1Y1", "G91", "M98P1", "M66P0"])("%s may move", (line) => {
  expect(macroMoves(macro(line))).toBe(true);
});

it.each(["$X", "M8", "M3 S1000 (spindle)", "$110=5000", "M9\n$#"])("%j moves nothing", (lines) => expect(macroMoves(macro(lines))).toBe(false));

it("sends code alone", () => expect(macroLines(macro("m8 (mist)\n\n; x\nG0 X1"))).toEqual(["M8", "G0X1"]));

it.each(["G0X1!", "~", "o100 call", "( )"])("refuses %j", (lines) => expect(() => macroLines(macro(lines))).toThrow());

it("reads what it can of a damaged store", () => {
  expect(readMacros(null)).toEqual([]);
  expect(readMacros("{")).toEqual([]);
  expect(readMacros('[{"name":"a","lines":"M8"},{"name":1},null,7]')).toEqual([{ name: "a", lines: "M8" }]);
});
