import { describe, expect, it } from "vitest";
import { gridOf, pinched, projection, SLANTED, TOP, zoomed, type Box, type Point } from "../src/job/projection";

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

describe("hands", () => {
  const at = (view: typeof TOP, mm: [number, number, number]): [number, number] => {
    const [u, v] = projection(view, box, 640, 400)(...mm);
    return [u - 320, v - 200];
  };

  it("zoom at a place, which stays", () => {
    const [x, y] = at(TOP, [10, 5, 0]);
    const view = zoomed(TOP, 2, { x, y });
    expect(at(view, [10, 5, 0])).toEqual([expect.closeTo(x), expect.closeTo(y)]);
    expect(zoomed(TOP, 1e9, { x, y }).zoom).toBeLessThan(100);
  });

  it("pinch: what is under each finger stays under it", () => {
    const [left, right, moved] = [at(TOP, [5, 5, 0]), at(TOP, [20, 5, 0]), at(TOP, [35, 5, 0])];
    const [still, before, after] = [left, right, moved].map(([x, y]) => ({ x, y })) as [Point, Point, Point];
    const view = pinched(TOP, still, before, after);
    expect(view.zoom).toBeCloseTo(2);
    expect(at(view, [5, 5, 0])).toEqual([expect.closeTo(still.x), expect.closeTo(still.y)]);
    expect(at(view, [20, 5, 0])).toEqual([expect.closeTo(after.x), expect.closeTo(after.y)]);
  });
});
