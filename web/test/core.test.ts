/** The core in WebAssembly against this computer's: tests/web/test_core.py gives the cases and what is right. */
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { Core } from "../src/job/core";
import { readProgram } from "../src/job/program";
import { laserWarning } from "../src/job/engraving";
import { sceneOf } from "../src/job/scene";
import { planResume, ResumeError, type MachineFacts } from "../src/job/resume";
import { TABLES, type HostField } from "../src/tables";

interface Cases {
  jobs: {
    name: string;
    source: string;
    board: Record<HostField, number>;
    settings: string[];
    seconds: number;
    min_mm: number[];
    max_mm: number[];
    errors: [number, number][];
    tool_changes: { line: number; tool: number }[];
    drawn: { top_mm_min: number; seconds: number[]; levels: number[] };
    burnt: { black: number; energies: number[]; slow_mm: number; worst: number; worst_line: number; said: string } | null;
  }[];
  resumes: { name: string; source: string; line: number; facts: MachineFacts; preamble: string[] | null; first: string | null }[];
}

const given = process.env.WIFICNC_CORE_CASES;
const cases: Cases = given ? (JSON.parse(readFileSync(given, "utf8")) as Cases) : { jobs: [], resumes: [] };
const load = (): Promise<Core> => Core.load(readFileSync(new URL("../../build/wasm/core.wasm", import.meta.url)));

describe.skipIf(!given)("the core", () => {
  it.each(cases.jobs)("runs $name as the simulator does", async (job) => {
    const core = await load();
    core.open(job.board);
    for (const line of job.settings) expect(core.command(line)).toBe(0);
    core.begin(job.source, 10);
    while (core.run(1_000_000));
    const report = core.report();
    expect(report.seconds).toBeCloseTo(job.seconds, 6);
    job.min_mm.forEach((low, i) => expect(report.min_mm[i]).toBeCloseTo(low, 4));
    job.max_mm.forEach((high, i) => expect(report.max_mm[i]).toBeCloseTo(high, 4));
    expect(report.errors.map((error) => [error.line, error.code])).toEqual(job.errors);
    expect(report.tool_changes).toEqual(job.tool_changes);
    expect(report.tool_change_count).toBe(job.tool_changes.length);
  });

  it.each(cases.jobs)("draws $name as `wificnc sim --plot` does", async (job) => {
    const core = await load();
    core.open(job.board);
    for (const line of job.settings) core.command(line);
    core.begin(job.source, TABLES.look.sample_ms);
    while (core.run(1_000_000));
    const report = core.report();
    const scene = sceneOf(core.samples(), core.pieces(), report);
    expect(scene.topSpeed_mm_min).toBeCloseTo(job.drawn.top_mm_min, 2);
    expect([...scene.seconds]).toEqual(job.drawn.seconds.map(Math.fround));
    expect([...scene.levels]).toEqual(job.drawn.levels);
    expect(scene.engraving === null).toBe(job.burnt === null);
    if (!scene.engraving || !job.burnt) return;
    const { black, levels } = scene.engraving;
    expect(black).toBeCloseTo(job.burnt.black, 6);
    expect(levels.length).toBe(job.burnt.energies.length);
    job.burnt.energies.forEach((energy, i) => expect(Math.abs(levels[i]! - Math.min(64, (energy / black) * 64))).toBeLessThan(0.51));
    expect(report.engraving).toMatchObject({ worst_line: job.burnt.worst_line });
    expect(report.engraving.slow_mm).toBeCloseTo(job.burnt.slow_mm, 6);
    expect(report.engraving.worst).toBeCloseTo(job.burnt.worst, 6);
    const { title, text } = laserWarning(report) ?? { title: "", text: "" };
    expect(`${title}: ${text}`.toLowerCase()).toBe(job.burnt.said.toLowerCase());
  });

  it.each(cases.resumes)("resumes $name at line $line as `wificnc send` does", async ({ name, source, line, facts, preamble, first }) => {
    const core = await load();
    const plan = (): ReturnType<typeof planResume> => planResume(core, readProgram(name, source).lines, line, facts);
    if (preamble === null) {
      expect(plan).toThrow(ResumeError);
      return;
    }
    const made = plan();
    expect(made.preamble).toEqual(preamble);
    expect(made.lines[preamble.length]!.code).toBe(first);
  });
});
