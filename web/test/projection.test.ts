import { describe, expect, it } from "vitest";
import { gridOf, projection, SLANTED, TOP, type Box } from "../src/job/projection";

const box: Box = { min: [0, -0.01, -1.7], max: [38.3, 28.3, 15] };

describe("the grid of a path", () => {
  it("reaches to whole lines around the path, and rounding opens no new cell", () => {
    expect(gridOf(box, 8)).toEqual({ step: 5, box: { min: [0, 0, -1.7], max: [40, 30, 15] } });
  });

  it.each([TOP, SLANTED])("is all of it in the picture", (view) => {
    const { box: grid } = gridOf(box, 8);
    const project = projection(view, grid, 640, 400);
    for (const x of [grid.min[0], grid.max[0]])
      for (const y of [grid.min[1], grid.max[1]]) {
        const [u, v] = project(x, y, grid.min[2]);
        expect(u).toBeGreaterThan(0);
        expect(u).toBeLessThan(640);
        expect(v).toBeGreaterThan(0);
        expect(v).toBeLessThan(400);
      }
  });
});
