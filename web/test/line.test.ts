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
