import { describe, expect, it } from "vitest";
import { PIECE_WORDS } from "../src/job/core";
import { AT_REST, engravingOf, laserWarning } from "../src/job/engraving";
import { levelColours } from "../src/job/scene";
import { TABLES } from "../src/tables";

/** [mm, s at full power] of each piece along X; 0 mm: at rest. */
function pieces(rows: [number, number][]): Float32Array {
  const words = new Float32Array(rows.length * PIECE_WORDS);
  let at = 0;
  rows.forEach(([mm, energy], i) => {
    words.set([i, at, 5, 0, at + mm, 5, 0, mm, energy], i * PIECE_WORDS);
    at += mm;
  });
  return words;
}

describe("what a laser burns", () => {
  it("is nothing without a beam", () => {
    expect(engravingOf(new Float32Array(0))).toBeNull();
  });

  it("goes by energy per length, and short dark ends do not make the rest pale", () => {
    const burnt = engravingOf(pieces([[1, 0.1], [60, 0.6], [38, 0.19], [1, 0.1]]))!;
    expect(burnt.black).toBeCloseTo(1.5 * 10, 4);
    expect([...burnt.levels]).toEqual([64, 43, 21, 64]);
    expect(burnt.length_mm).toBeCloseTo(100, 4);
    expect([...burnt.ends.slice(6, 12)]).toEqual([1, 5, 0, 61, 5, 0]);
  });

  it("has a dot where it burns at rest", () => {
    const burnt = engravingOf(pieces([[10, 0.1], [0, 0.5]]))!;
    expect([...burnt.levels]).toEqual([43, AT_REST]);
    expect(burnt.black).toBeCloseTo(15, 4);
  });

  it("is dark on white and light on black", () => {
    for (const dark of [false, true]) {
      const colours = levelColours(dark, "engraving");
      const [first, last] = [colours[0]!, colours.at(-1)!].map((rgb) => Number(rgb.match(/\d+/)![0]));
      expect(first! > last!).toBe(!dark);
      expect(colours.length).toBe(TABLES.look.speed.levels + 1);
    }
  });
});

describe("the warning of constant power", () => {
  const report = { constant_mm: 840, slow_mm: 12.34, limit: 1.2, worst: 2.44, worst_line: 17, worst_mm: [1, 2.5, 0] };

  it("says how much, where and how to avoid it", () => {
    const { text } = laserWarning({ engraving: report })!;
    expect(text).toContain("More than 1.2 x the energy of the feed on 12.3 mm of 840.0 mm, at most 2.4 x in line 17 at X1.000 Y2.500 Z0.000.");
    expect(text).toContain("M4");
  });

  it("is not there without a reason", () => {
    expect(laserWarning({ engraving: { ...report, slow_mm: 0 } })).toBeNull();
  });
});
