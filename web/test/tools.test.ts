import { expect, it } from "vitest";
import { rowOf, toolLine, toolProblem, toolsOf } from "../src/link/tools";

const FLAT = { number: 2, length_mm: 12.5, diameter_mm: 6, text: "6 mm flat" };

it("reads the rows of $# and no others", () => {
  const said = ["[G54:0.000,0.000,0.000]", "[TLO:0.000]", "[T:2|0.000,0.000,12.500|3.000|6 mm flat]", "[T:96|0.000,0.000,-3.000|0.000]", "[PRB:0.000,0.000,0.000:0]"];
  expect(toolsOf(said, false)).toEqual([FLAT, { number: 96, length_mm: -3, diameter_mm: 0, text: "" }]);
});

it("reads inches where reports are in inches", () => {
  const [tool] = toolsOf(["[T:1|0.0000,0.0000,1.0000,0.000|0.1250|1/4 in]"], true);
  expect(tool).toEqual({ number: 1, length_mm: 25.4, diameter_mm: 6.35, text: "1/4 in" });
});

it("stores a row with one line", () => {
  expect(toolLine(FLAT)).toBe("G10L1P2Z12.5R3(6 mm flat)");
  expect(toolLine({ number: 3, length_mm: 0, diameter_mm: 0, text: " " })).toBe("G10L1P3Z0R0( )");
  expect(toolLine({ ...FLAT, diameter_mm: 25.4 / 8 })).toBe("G10L1P2Z12.5R1.5875(6 mm flat)");
});

it.each([
  [FLAT, ""],
  [{ ...FLAT, number: 0 }, "The number of a tool"],
  [{ ...FLAT, number: 97 }, "The number of a tool"],
  [{ ...FLAT, number: 1.5 }, "The number of a tool"],
  [{ ...FLAT, length_mm: NaN }, "The length"],
  [{ ...FLAT, diameter_mm: -1 }, "The diameter"],
  [{ ...FLAT, text: "Schaftfräser" }, "A text has letters"],
  [{ ...FLAT, text: "flat (new)" }, "A text has letters"],
  [{ ...FLAT, text: "flat!" }, "A text has letters"],
  [{ ...FLAT, text: "which?" }, "A text has letters"],
  [{ ...FLAT, text: "~6 mm" }, "A text has letters"],
  [{ ...FLAT, text: "x".repeat(24) }, "A text has at most 23"],
])("refuses what the controller would not keep: %j", (tool, says) => {
  expect(toolProblem(tool).startsWith(says)).toBe(true);
  expect(toolProblem(tool) === "").toBe(says === "");
});

it("leaves what is not typed as it is: a tool that loses its length breaks at the next G43", () => {
  const typed = { number: "2", length: "", diameter: " ", text: "new" };
  expect(rowOf(typed, [FLAT], false)).toEqual({ ...FLAT, text: "new" });
  expect(rowOf({ ...typed, length: "0", diameter: "1" }, [FLAT], true)).toEqual({ number: 2, length_mm: 0, diameter_mm: 25.4, text: "new" });
  expect(rowOf({ ...typed, number: "3" }, [FLAT], false)).toEqual({ number: 3, length_mm: 0, diameter_mm: 0, text: "new" });
  expect(rowOf({ ...typed, length: "x" }, [FLAT], false).length_mm).toBeNaN();
});
