import { readFileSync } from "node:fs";
import { expect, it } from "vitest";
import { endingWords, type Ending } from "../src/job/ending";
import { codeOf, numbered, ProgramError, readProgram } from "../src/job/program";

const vectors = new URL("../../protocol/vectors/program_end.json", import.meta.url);
const { cases: ends } = JSON.parse(readFileSync(vectors, "utf8")) as { cases: (Ending & { name: string; lines: string[]; run: number[] })[] };

it.each(ends)("ends a program: $name", ({ lines, run, line, unrun, first, second }) => {
  const program = readProgram("a.nc", lines.join("\n"));
  expect(program.lines.map(({ number }) => number)).toEqual(run);
  expect(program.ending).toMatchObject({ line, unrun, first, second });
  expect(endingWords(program.ending) !== null).toBe(unrun > 0);
});

it("drops comments and blanks, and keeps the file's line numbers", () => {
  const program = readProgram("a.nc", "%\r\n(start ! of ~ it)\r\ng1 x1.5 (ü) f 100 ; end?\rG0X0\n\n%\n");
  expect(program.lines).toEqual([
    { number: 3, text: "g1 x1.5 (ü) f 100 ; end?", code: "G1X1.5F100" },
    { number: 4, text: "G0X0", code: "G0X0" },
  ]);
  expect(program.fileLines).toBe(6);
});

it("takes an open comment to the end of its line", () => expect(codeOf("G0 (x G1")).toBe("G0"));

it.each([["G1X1!"], ["G1X1?"], ["~"], ["G1X\u00e4"], ["G1X1\u0018"]])("refuses %j, which would act as a command", (line) =>
  expect(() => readProgram("a.nc", `G0X0\n${line}\n`)).toThrow(/line 2: characters/),
);

it.each([
  [7, "G1X1", "N7G1X1"],
  [7, "N100G1X1N5", "N7G1X1"],
  [0, "G1X1", "G1X1"],
  [7, "$H", "$H"],
  [7, `G1X${"0".repeat(253)}`, `G1X${"0".repeat(253)}`],
  [7, `G1X${"0".repeat(76)}`, `N7G1X${"0".repeat(76)}`],
  [10_000_001, "G1", "G1"],
])("numbers line %i, %j, for reports", (number, code, wire) => expect(numbered({ number, text: code, code })).toBe(wire));

it("refuses O words, which the controller would, too", () =>
  expect(() => readProgram("a.nc", "G0X0\no100 while [#1 LT 3]\n")).toThrow(/line 2: O words/));

it.each([["O1000"], ["o0001 (BRACKET)"], ["N1 O7"], [":1000"], ["N9%"]])("keeps %j here: it marks the program", (mark) =>
  expect(readProgram("a.nc", `${mark}\nG0X1\n`).lines.map((line) => line.code)).toEqual(["G0X1"]),
);

it("refuses a file without code", () => expect(() => readProgram("a.nc", "(nothing)\n")).toThrow(ProgramError));

it("does not take the comment of a line for its code", () => expect(readProgram("a.nc", "T2 M6 (drill)").lines[0]!.code).toBe("T2M6"));

it.each(["G10 L1 P2 Z1 (6 mm!)", "G10 L1 P2 Z1 (Fräser)", `G10 L1 P2 Z1 (${"x".repeat(300)})`])("refuses %j: the text cannot be sent", (text) =>
  expect(() => readProgram("a.nc", text)).toThrow(/line 1: (characters|more than)/),
);

it("names the bracket within a comment", () => expect(() => readProgram("a.nc", "G21\n(2D Contour1 (2))\nG0X1\n")).toThrow(/line 2: a comment ends at its first \)/));

it("sends a line with a message alone", () =>
  expect(readProgram("a.nc", "(start)\n(MSG, turn it over)\nG0X1\n(done, it is)\n").lines.map((line) => numbered(line))).toEqual(["N2(MSG, turn it over)", "N3G0X1"]));
