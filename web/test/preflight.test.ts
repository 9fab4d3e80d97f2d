/** The page's side of the core in workers: workers of a few lines of test, which answer by hand. */
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { PreflightRunner, secondsLeft } from "../src/job/preflight";
import { readProgram } from "../src/job/program";
import { NOWHERE } from "../src/job/standing";
import { findBoard } from "../src/boards";
import type { MachineFacts, Resume } from "../src/job/resume";
import type { PreflightRequest, ResumeRequest, WorkerReply } from "../src/job/worker";

const HOST = findBoard("host")!;
const PROGRAM = readProgram("square.nc", "G0X1\nG1X2F600\n");
const FACTS: MachineFacts = { axisCount: 3, machine_mm: [0, 0, 0], offsets: {}, laser: false };
const RESUME = { line: 2, preamble: ["G21"], lines: [], notes: [] } as unknown as Resume;

class StandIn {
  static made: StandIn[] = [];
  onmessage: (event: { data: WorkerReply }) => void = () => {};
  onerror: (event: { message: string }) => void = () => {};
  request: PreflightRequest | ResumeRequest | null = null;
  lives = true;

  constructor() {
    StandIn.made.push(this);
  }
  postMessage(request: PreflightRequest | ResumeRequest): void {
    this.request = request;
  }
  terminate(): void {
    this.lives = false;
  }
  /** As a worker, that of an ended one is heard by no one. */
  answers(data: unknown): void {
    if (this.lives) this.onmessage({ data: data as WorkerReply });
  }
}

const CHECKED = { kind: "preflight", report: {}, scene: {}, timeline: new Float64Array(), refused: [] };

async function asked(count: number): Promise<StandIn[]> {
  await vi.waitFor(() => expect(StandIn.made.filter((worker) => worker.request)).toHaveLength(count));
  return StandIn.made;
}

beforeEach(() => {
  StandIn.made = [];
  vi.stubGlobal("Worker", StandIn);
  vi.stubGlobal("fetch", async () => ({ ok: true, arrayBuffer: async () => new ArrayBuffer(8) }));
});
afterEach(() => void vi.unstubAllGlobals());

it("prepares a resume while a check begins: the machine has told a new offset", async () => {
  const runner = new PreflightRunner();
  const plan = runner.plan(PROGRAM.lines, 2, FACTS);
  await asked(1);
  const check = runner.check(PROGRAM, HOST, NOWHERE);
  const [planning, checking] = await asked(2);
  planning!.answers({ kind: "resume", resume: RESUME });
  expect(await plan).toBe(RESUME);
  checking!.answers(CHECKED);
  await check;
  expect(runner.result.value?.program).toBe(PROGRAM);
});

it("finishes a check during which a resume was prepared", async () => {
  const runner = new PreflightRunner();
  const check = runner.check(PROGRAM, HOST, NOWHERE);
  await asked(1);
  const plan = runner.plan(PROGRAM.lines, 2, FACTS);
  const [checking, planning] = await asked(2);
  checking!.answers(CHECKED);
  planning!.answers({ kind: "resume", resume: RESUME });
  expect(await plan).toBe(RESUME);
  await check;
  expect(runner.progress.value).toBeNull();
  expect(StandIn.made.some((worker) => worker.lives)).toBe(false);
});

it("ends the older of two checks, and only its answer is missing", async () => {
  const runner = new PreflightRunner();
  const first = runner.check(PROGRAM, HOST, NOWHERE);
  await asked(1);
  const second = runner.check(PROGRAM, HOST, NOWHERE);
  const [older, newer] = await asked(2);
  await first;
  expect(older!.lives).toBe(false);
  expect(runner.progress.value).toBe(0);
  newer!.answers(CHECKED);
  await second;
  expect(runner.result.value).not.toBeNull();
});

it("answers both of two clicks on Prepare, the first by nothing", async () => {
  const runner = new PreflightRunner();
  const plans = [runner.plan(PROGRAM.lines, 2, FACTS), runner.plan(PROGRAM.lines, 2, FACTS)];
  const [planning] = await asked(1);
  planning!.answers({ kind: "resume", resume: RESUME });
  expect(await Promise.all(plans)).toEqual([null, RESUME]);
});

it("forgets what is under way with the job", async () => {
  const runner = new PreflightRunner();
  const work = [runner.check(PROGRAM, HOST, NOWHERE), runner.plan(PROGRAM.lines, 2, FACTS)];
  await asked(2);
  runner.forget();
  expect(await Promise.all(work)).toEqual([undefined, null]);
  expect(StandIn.made.some((worker) => worker.lives)).toBe(false);
  expect(runner.progress.value).toBeNull();
});

it("tells why no resume could be prepared, and prepares the next", async () => {
  const runner = new PreflightRunner();
  const plan = runner.plan(PROGRAM.lines, 2, FACTS);
  const [planning] = await asked(1);
  planning!.answers({ kind: "failed", why: "line 2 is in an arc", hint: "choose another line" });
  await expect(plan).rejects.toThrow("line 2 is in an arc");
  const again = runner.plan(PROGRAM.lines, 1, FACTS);
  const [, next] = await asked(2);
  next!.answers({ kind: "resume", resume: RESUME });
  expect(await again).toBe(RESUME);
});

it("tells the time that is left by the overrides", () => {
  const report = { seconds: 100, cutting_seconds: 60, rapid_seconds: 30 }; // and 10 s of dwells
  expect(secondsLeft(report, 0, 100, 100)).toBe(100);
  expect(secondsLeft(report, 0, 50, 100)).toBeCloseTo(160);
  expect(secondsLeft(report, 50, 200, 25)).toBeCloseTo((30 + 120 + 10) / 2);
  expect(secondsLeft(report, 120, 100, 100)).toBe(0);
  expect(secondsLeft({ seconds: 0, cutting_seconds: 0, rapid_seconds: 0 }, 0, 100, 100)).toBe(0);
});
