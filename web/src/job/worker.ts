/** The core in a thread of its own: whole jobs are run there, and the page stays quick. */
import { Core, type Report } from "./core";
import { sceneOf, type Scene } from "./scene";
import { TABLES, type HostField } from "../tables";
import { matters } from "./standing";
import { planResume, ResumeError, type MachineFacts, type Resume } from "./resume";
import type { JobLine } from "./program";
import { useCatalogue, type Catalogue } from "../words";

export interface PreflightRequest {
  kind: "preflight";
  wasm: ArrayBuffer;
  words: Catalogue;
  board: Record<HostField, number>;
  /** Lines before the job (standing.ts). */
  before: string[];
  /** Where the machine has its work zero: what is drawn has its zero there. */
  origin_mm: readonly number[];
  job: string;
}

export interface ResumeRequest {
  kind: "resume";
  wasm: ArrayBuffer;
  words: Catalogue;
  lines: JobLine[];
  line: number;
  facts: MachineFacts;
}

/** When the motion of a line begins, in seconds of the job: line, second, line, second ... */
export type Timeline = Float64Array<ArrayBuffer>;

export type WorkerReply =
  | { kind: "progress"; linesDone: number; seconds: number }
  | { kind: "preflight"; report: Report; scene: Scene; timeline: Timeline; refused: string[] }
  | { kind: "resume"; resume: Resume }
  | { kind: "failed"; why: string; hint: string };

/** Step events: a moment of the job, to distinguish lines. */
const EVENTS_A_TURN = 2_000;
const TELL_MS = 100;

function reply(message: WorkerReply, transfer: Transferable[] = []): void {
  (self as unknown as DedicatedWorkerGlobalScope).postMessage(message, transfer);
}

async function preflight(request: PreflightRequest): Promise<void> {
  const core = await Core.load(request.wasm);
  core.open(request.board);
  const refused = request.before.filter((line) => core.command(line) !== 0 && matters(line));
  core.begin(request.job, TABLES.look.sample_ms);
  const times: number[] = [];
  let told = performance.now();
  for (let more = true; more; ) {
    more = core.run(EVENTS_A_TURN);
    times.push(core.lineNow, core.seconds);
    if (performance.now() - told > TELL_MS) {
      told = performance.now();
      reply({ kind: "progress", linesDone: core.linesDone, seconds: core.seconds });
    }
  }
  const report = core.report();
  const scene = sceneOf(core.samples(), core.pieces(), report, request.origin_mm);
  const timeline = Float64Array.from(times);
  const { seconds, points, levels, plunges, engraving } = scene;
  const burnt = engraving ? [engraving.seconds, engraving.ends, engraving.levels] : [];
  const moved = [seconds, points, levels, plunges, timeline, ...burnt].map((array) => array.buffer as ArrayBuffer);
  reply({ kind: "preflight", report, scene, timeline, refused }, moved);
}

async function resume(request: ResumeRequest): Promise<void> {
  const core = await Core.load(request.wasm);
  reply({ kind: "resume", resume: planResume(core, request.lines, request.line, request.facts) });
}

self.onmessage = (event: MessageEvent<PreflightRequest | ResumeRequest>) => {
  const request = event.data;
  useCatalogue(() => request.words);
  const work = request.kind === "preflight" ? preflight(request) : resume(request);
  work.catch((error: unknown) => {
    const hint = error instanceof ResumeError ? error.hint : "";
    reply({ kind: "failed", why: error instanceof Error ? error.message : String(error), hint });
  });
};

