import { expect, it } from "vitest";
import { checkLine, LineError, realtimeOf, typedLine } from "../src/link/line";

it.each([
  ["(Ä) G0 X1", "G0 X1"],
  ["G0 X1 ; über!", "G0 X1"],
  ["G0 (what?", "G0"],
  ["(only ~)", ""],
  ["$J=X1F100", "$J=X1F100"],
  ["G10 L20 P1 X0 (zero)", "G10 L20 P1 X0"],
])("takes %j without its comment", (text, line) => expect(typedLine(text)).toBe(line));

it.each([
  ["G10 L1 P2 Z12.5 R3 (6 mm flat) ; mine", "G10 L1 P2 Z12.5 R3(6 mm flat)"],
  ["g10p2l1z5(flat)", "g10p2l1z5(flat)"],
  ["G10 L1 P2 Z5 ; ball (3 mm)", "G10 L1 P2 Z5(ball [3 mm])"],
  ["G10 L1 P2 Z5 ( )", "G10 L1 P2 Z5( )"],
  ["G10 L10 P2 Z5 (touch off)", "G10 L10 P2 Z5"],
  ["T2 M6 (Fräser 6 mm!)", "T2 M6(Fraser 6 mm)"],
  ["m06(a)t2(b", "m06t2(ab)"],
  ["M60 (pallet)", "M60"],
])("keeps of %j what the controller keeps or shows", (text, line) => expect(typedLine(text)).toBe(line));

it("refuses a text of a tool that a controller cannot store", () => {
  expect(() => typedLine("G10L1P2(Fräser)")).toThrow(/letters without accents/);
  expect(() => typedLine("G10L1P2(what?)")).toThrow(/status report/);
});

it.each(["G0Ä", "é", "G0\u0085", "G0\tX1", "G1X1!", "X?", "~~", "\u{1f600}", "G0\x18"])("refuses %j", (text) => {
  expect(() => typedLine(text)).toThrow(LineError);
  expect(() => checkLine(text)).toThrow(LineError);
});

it("knows a real-time command that is alone on its line", () => {
  expect(["!", " ~ ", "?", "!!", "G0"].map(realtimeOf)).toEqual(["HOLD", "RESUME", "STATUS", null, null]);
});
