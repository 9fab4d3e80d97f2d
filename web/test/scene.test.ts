import { describe, expect, it } from "vitest";
import { SAMPLE_WORDS } from "../src/job/core";
import { cutWidth, levelColours, RAPID, sceneOf } from "../src/job/scene";
import { TABLES } from "../src/tables";

/** [s, x, y, z, mm/min, rapid] of each sample. */
function samples(rows: number[][]): Float32Array {
  const words = new Float32Array(rows.length * SAMPLE_WORDS);
  const kinds = new Uint32Array(words.buffer);
  rows.forEach(([s, x, y, z, speed, rapid], i) => {
    words.set([s!, x!, y!, z!], i * SAMPLE_WORDS);
    words[i * SAMPLE_WORDS + 7] = speed! / 60;
    kinds[i * SAMPLE_WORDS + 8] = rapid!;
  });
  return words;
}

describe("what is drawn of a path", () => {
  it("keeps corners, changes of speed and rapids, and drops what lies between", () => {
    const scene = sceneOf(
      samples([
        [0, 0, 0, 0, 0, 1],
        [1, 5, 0, 0, 6000, 1],
        [2, 10, 0, 0, 6000, 1],
        [3, 10, 5, 0, 600, 0],
        [4, 10, 7, 0, 600, 0],
        [5, 10, 10, 0, 600, 0],
        [6, 10, 12, 0, 300, 0],
      ]),
      new Float32Array(0),
      { min_mm: [0, 0, 0], max_mm: [10, 12, 0] },
    );
    expect([...scene.seconds]).toEqual([0, 2, 5, 6]);
    expect([...scene.levels]).toEqual([RAPID, RAPID, 64, 32]);
    expect([...scene.points.slice(3, 6)]).toEqual([10, 0, 0]);
    expect(scene.topSpeed_mm_min).toBeCloseTo(600, 3);
  });

  it("shows a hole from above once, whichever way the tool goes", () => {
    const hole = (s: number, x: number): number[][] => [
      [s, x, 0, 1, 6000, 1],
      [s + 1, x, 0, -2, 100, 0],
      [s + 2, x, 0, 1, 100, 0],
    ];
    const scene = sceneOf(samples([...hole(0, 0), ...hole(10, 4)]), new Float32Array(0), { min_mm: [0, 0, -2], max_mm: [4, 0, 1] });
    expect([...scene.plunges].map((i) => scene.points[i * 3])).toEqual([0, 4]);
  });

  it("draws a job that never moves", () => {
    const scene = sceneOf(new Float32Array(0), new Float32Array(0), { min_mm: [0, 0, 0], max_mm: [0, 0, 0] });
    expect([scene.points.length, scene.topSpeed_mm_min]).toEqual([0, 1]);
  });

  it.each([false, true])("has a colour for each speed, from one end of the table to the other (dark: %s)", (dark) => {
    const colours = levelColours(dark, "speed");
    const hex = (rgb: string): string => `#${rgb.match(/\d+/g)!.map((n) => Number(n).toString(16).padStart(2, "0")).join("")}`;
    const stops = dark ? TABLES.look.speed.dark : TABLES.look.speed.light;
    expect(colours.length).toBe(TABLES.look.speed.levels + 1);
    stops.forEach((stop, n) => expect(hex(colours[(n * TABLES.look.speed.levels) / (stops.length - 1)]!)).toBe(stop));
  });

  it("draws dense jobs with finer lines", () => {
    expect([1, 316, 100_000, 1e7].map((count) => Number(cutWidth(count).toFixed(2)))).toEqual([1.7, 1.7, 0.6, 0.6]);
  });
});
