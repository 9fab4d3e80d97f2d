/** Probing cycles against bodies that are formulas: where work zero comes to lie, and that nothing is hit on the way. */
import { expect, it } from "vitest";
import { edgeAngle_deg, planProbe, ProbeError, probeProblem, runProbe, USUAL, type Cycle, type ProbeMachine, type ProbeValues } from "../src/link/probing";

type Place = [number, number, number];
const STEP_MM = 0.01;

/** A machine in a world; a jog that meets the body has broken the tool. */
class Bench implements ProbeMachine {
  readonly zero: Record<string, number> = {};
  lines: string[] = [];

  constructor(
    readonly at: Place,
    private readonly inBody: (x: number, y: number, z: number) => boolean,
  ) {}

  async send(line: string): Promise<string[]> {
    this.lines.push(line);
    const [, axis, text] = /([XYZ])(-?[\d.]+)/.exec(line)!;
    const i = "XYZ".indexOf(axis!);
    const goal = Number(text) + (line.includes("G53") ? 0 : this.at[i]!);
    const probes = line.includes("G38.3");
    const prb = (): string[] => [`[PRB:${this.at.map((mm) => mm.toFixed(3)).join()}:${this.isTouching() ? 1 : 0}]`];
    while (Math.abs(goal - this.at[i]!) > STEP_MM / 2) {
      if (probes && this.isTouching()) return prb();
      this.at[i]! += Math.sign(goal - this.at[i]!) * STEP_MM;
      if (!probes && this.isTouching() && !line.startsWith("$J=G21G91")) throw new Error(`${line} hits the body at ${this.at}`);
    }
    return probes ? prb() : [];
  }
  async rest(): Promise<void> {}
  async move(line: string): Promise<void> {
    await this.send(line);
  }
  machine_mm(): readonly number[] {
    return this.at;
  }
  report_mm(): number {
    return 1;
  }
  isTouching(): boolean {
    return this.inBody(...this.at);
  }
  async setLength(contact_mm: number): Promise<void> {
    this.zero.length = contact_mm;
  }
  async setPosition(axis: string, value_mm: number): Promise<void> {
    this.zero[axis] = this.at["XYZ".indexOf(axis)]! - value_mm;
  }
}

const TOOL_MM = 6;
const R = TOOL_MM / 2;
/** X 10..60, Y 20..80, Z below -5; the plate on it reaches 4 mm out and 10 mm up. */
const block = (x: number, y: number, z: number, grow = R): boolean => z < -5 && x > 10 - grow && x < 60 + grow && y > 20 - grow && y < 80 + grow;

const run = (cycle: Cycle, bench: Bench, values: Partial<ProbeValues> = {}): Promise<unknown> =>
  runProbe(planProbe(cycle, { ...USUAL, tool_mm: TOOL_MM, ...values }), bench, () => "");

it("sets Z to the thickness of the plate that it touches, and lifts off", async () => {
  const bench = new Bench([0, 0, 3], (_x, _y, z) => z < -5 + 10);
  const lower = new Bench([0, 0, 12], (_x, _y, z) => z < -5 + 10);
  await expect(run("plate", bench)).rejects.toThrow("in contact already");
  expect(bench.lines).toEqual([]);
  await run("plate", lower);
  expect(lower.zero.Z).toBeCloseTo(-5, 1);
  expect(lower.at[2]).toBeGreaterThan(10);
});

it.each([
  [-1, -1, [20, 30], [10, 20]],
  [1, -1, [50, 30], [60, 20]],
  [-1, 1, [20, 70], [10, 80]],
  [1, 1, [50, 70], [60, 80]],
] as const)("finds the corner %d %d from above it, with a plate around it", async (sideX, sideY, [x, y], [zeroX, zeroY]) => {
  const plate = (px: number, py: number, pz: number): boolean => block(px, py, pz - 10, R + 4);
  const bench = new Bench([x, y, 8], plate);
  await run("corner", bench, { wall_mm: 4, out_mm: 30, reach_mm: 30, side: { X: sideX, Y: sideY } });
  expect(bench.zero.X).toBeCloseTo(zeroX, 1);
  expect(bench.zero.Y).toBeCloseTo(zeroY, 1);
  expect(bench.zero.Z).toBeCloseTo(-5, 1);
});

it("finds the middle of a hole, wherever in it it starts", async () => {
  const round = (x: number, y: number): boolean => Math.hypot(x - 3, y + 4) > 12 - R;
  const bench = new Bench([5, -2, 0], round);
  await run("hole", bench);
  await run("hole", bench); // the chords of the first time were not quite through the middle
  expect(bench.zero.X).toBeCloseTo(3, 1);
  expect(bench.zero.Y).toBeCloseTo(-4, 1);
  expect(bench.at[0]).toBeCloseTo(3, 1);
});

it("finds the middle of a boss from above it, and is above it again", async () => {
  const bench = new Bench([33, 52, -2], block);
  await run("boss", bench, { width_mm: 60, out_mm: 10, reach_mm: 30 });
  expect(bench.zero).toMatchObject({ X: expect.closeTo(35, 1), Y: expect.closeTo(50, 1) });
  expect(bench.at).toEqual([expect.closeTo(35, 1), expect.closeTo(50, 1), expect.closeTo(-2, 5)]);
});

it.each([
  [-1, [0, 50, -8], 10],
  [1, [70, 50, -8], 60],
] as const)("finds the edge on side %d", async (side, at, zero) => {
  const bench = new Bench([...at], block);
  await run("edge", bench, { edge: "X", side: { X: side, Y: -1 } });
  expect(bench.zero).toEqual({ X: expect.closeTo(zero, 1) });
});

it.each([
  ["X", -1, [-20, 0, -8], 3],
  ["X", 1, [80, 0, -8], -2],
  ["Y", -1, [0, -20, -8], 3],
  ["Y", 1, [0, 80, -8], -2],
] as const)("measures how far the edge %s %d is turned, and returns", async (edge, side, at, turn_deg) => {
  const [sin, cos] = [Math.sin((turn_deg * Math.PI) / 180), Math.cos((turn_deg * Math.PI) / 180)];
  const turned = (x: number, y: number): boolean => {
    const [u, v] = [x * cos + y * sin, y * cos - x * sin]; // in the frame of the work
    return (edge === "X" ? (side < 0 ? u > 0 - R : u < 60 + R) : side < 0 ? v > 0 - R : v < 60 + R);
  };
  const bench = new Bench([...at], turned);
  const values = { ...USUAL, edge, side: { X: side, Y: side }, width_mm: 100, reach_mm: 60 };
  const contacts = await runProbe(planProbe("rotation", values), bench, () => "");
  expect(edgeAngle_deg(values, contacts)).toBeCloseTo(turn_deg, 1);
  expect(bench.at).toEqual(at.map((mm) => expect.closeTo(mm, 1) as number));
  expect(bench.zero).toEqual({});
});

it("measures a tool where it touches, and lifts off", async () => {
  const bench = new Bench([0, 0, 12], (_x, _y, z) => z < 3.5);
  await run("length", bench);
  expect(bench.zero).toEqual({ length: expect.closeTo(3.5, 1) });
  expect(bench.at[2]).toBeGreaterThan(9);
});

it("ends at a contact where none may be, and where there is none", async () => {
  const clamp = new Bench([33, 52, -2], (x, y, z) => block(x, y, z) || (z < 5 && x < 5));
  await expect(run("boss", clamp, { width_mm: 60, out_mm: 10 })).rejects.toThrow("must be free");
  expect(clamp.zero).toEqual({});
  const air = new Bench([0, 0, 0], () => false);
  await expect(run("plate", air)).rejects.toThrow(ProbeError);
  expect([air.zero, air.lines.length]).toEqual([{}, 1]);
});

it("ends with a jog that someone else has stopped, before the way back goes through the work", async () => {
  const bench = new Bench([33, 52, -2], block);
  bench.move = async (line) => {
    await bench.send(line);
    if (/^\$J=G21G91Z/.test(line)) throw new Error("stopped at the machine");
  };
  await expect(run("boss", bench, { width_mm: 60, out_mm: 10, reach_mm: 30 })).rejects.toThrow("stopped at the machine");
  expect(bench.lines.at(-1)).toMatch(/^\$J=G21G91Z/);
  expect(bench.zero).toEqual({});
});

it("sends nothing more when the machine is not its own any more, whatever the last line has found", async () => {
  const bench = new Bench([0, 0, 12], (_x, _y, z) => z < -5 + 10);
  const why = (): string => (bench.lines.length > 0 ? "resumed at the machine" : "");
  await expect(runProbe(planProbe("plate", USUAL), bench, why)).rejects.toThrow("resumed at the machine");
  expect([bench.lines.length, bench.zero]).toEqual([1, {}]);
});

it("moves nothing while it is not known where the machine is", async () => {
  const bench = new Bench([0, 0, 12], () => false);
  bench.machine_mm = () => [];
  await expect(run("hole", bench)).rejects.toThrow("has not reported its position");
  expect(bench.lines).toEqual([]);
});

it("checks the numbers before anything moves", () => {
  expect(probeProblem(USUAL)).toBe("");
  expect(probeProblem({ ...USUAL, feed_mm_min: 2000 })).toMatch(/^The feed/);
  expect(probeProblem({ ...USUAL, reach_mm: NaN })).toMatch(/^The reach/);
});
