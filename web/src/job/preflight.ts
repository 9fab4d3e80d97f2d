/** The page's side of the core in workers: one preflight and one resume at a time; a newer one ends the older. */
import { signal } from "@preact/signals";
import wasmUrl from "../../../build/wasm/core.wasm?url";
import type { Board } from "../tables";
import { ErrorKind, type CoreError, type Report } from "./core";
import type { JobLine, Program } from "./program";
import type { Scene } from "./scene";
import { linesBefore, type Standing } from "./standing";
import { ResumeError, type MachineFacts, type Resume } from "./resume";
import type { PreflightRequest, ResumeRequest, Timeline, WorkerReply } from "./worker";
import { alarmWords, errorWords } from "../tables";
import { catalogue, t } from "../words";

export interface Preflight {
  program: Program;
  report: Report;
  scene: Scene;
  timeline: Timeline;
  /** The state of the machine; NOWHERE: none was connected, and settings are defaults. */
  standing: Standing;
  /** Lines before the job that the core has refused: it is not set up as the machine is. */
  refused: string[];
}

type Request = Omit<PreflightRequest, "wasm" | "words"> | Omit<ResumeRequest, "wasm" | "words">;
type Finished = Exclude<WorkerReply, { kind: "progress" }>;

/** One request at a time, in a worker that ends with it. */
class Work {
  /** Of the request that is under way: what ends it. */
  private ends: (() => void) | null = null;

  end(): void {
    this.ends?.();
  }

  /** null: a newer request took its place, or it was ended. */
  async ask(request: Request, module: Promise<ArrayBuffer>, tell: (linesDone: number) => void): Promise<Finished | null> {
    this.end();
    let ended = false;
    const end = (): void => void (ended = true);
    this.ends = end;
    const wasm = (await module).slice(0);
    if (ended) return null;
    const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    const done = new Promise<Finished | null>((resolve, reject) => {
      this.ends = () => resolve(null);
      worker.onmessage = (event: MessageEvent<WorkerReply>) => {
        const reply = event.data;
        if (reply.kind === "progress") tell(reply.linesDone);
        else if (reply.kind === "failed") reject(new ResumeError(reply.why, reply.hint));
        else resolve(reply);
      };
      worker.onerror = (event) => reject(new Error(event.message));
    });
    worker.postMessage({ ...request, words: catalogue(), wasm }, [wasm]);
    return done.finally(() => worker.terminate());
  }
}

export class PreflightRunner {
  readonly result = signal<Preflight | null>(null);
  /** 0..1 while it runs; null: it does not. */
  readonly progress = signal<number | null>(null);
  readonly failed = signal("");
  private readonly checking = new Work();
  private readonly planning = new Work();
  private wasm: Promise<ArrayBuffer> | null = null;

  /** Run the job on a board like this, from a machine in this state. */
  async check(program: Program, board: Board, standing: Standing): Promise<void> {
    this.progress.value = 0;
    this.failed.value = "";
    this.result.value = null;
    try {
      const request = { kind: "preflight", board: board.host, before: linesBefore(standing), origin_mm: standing.origin_mm, job: program.source } as const;
      const done = await this.checking.ask(request, this.module(), (linesDone) => {
        this.progress.value = Math.min(1, linesDone / program.fileLines);
      });
      if (done?.kind !== "preflight") return;
      const { report, scene, timeline, refused } = done;
      this.result.value = { program, report, scene, timeline, standing, refused };
      this.progress.value = null;
    } catch (error) {
      this.progress.value = null;
      this.failed.value = error instanceof Error ? error.message : String(error);
    }
  }

  /** Nothing was checked; what is under way ends. */
  forget(): void {
    this.checking.end();
    this.planning.end();
    this.result.value = null;
    this.progress.value = null;
    this.failed.value = "";
  }

  /** null: a newer one took its place, or the job was closed. Rejects with a ResumeError when it cannot be known how
      the job stood there. */
  async plan(lines: JobLine[], line: number, facts: MachineFacts): Promise<Resume | null> {
    const done = await this.planning.ask({ kind: "resume", lines, line, facts }, this.module(), () => {});
    return done?.kind === "resume" ? done.resume : null;
  }

  private module(): Promise<ArrayBuffer> {
    this.wasm ??= fetch(wasmUrl).then((answer) => {
      if (!answer.ok) throw new Error(t`cannot load the core: ${answer.status}`);
      return answer.arrayBuffer();
    });
    return this.wasm;
  }
}

/** One finding of the preflight, in words. */
export function describe(error: CoreError): string {
  const where = error.line ? t`Line ${error.line}: ` : "";
  switch (error.kind) {
    case ErrorKind.Error:
      return t`${where}error ${error.code}, ${errorWords(error.code)}`;
    case ErrorKind.Alarm:
      return t`${where}alarm ${error.code}, ${alarmWords(error.code)}`;
    case ErrorKind.NoAnswer:
      return t`${where}the controller never answers this line`;
    default:
      return t`${where}the job would end here`;
  }
}

/** Seconds of the job when this line (1-based in the file) began to move. */
export function secondsAtLine(timeline: Timeline, line: number): number {
  let [low, high] = [0, timeline.length / 2]; // the first entry of this line or a later one
  while (low < high) {
    const middle = (low + high) >> 1;
    if (timeline[middle * 2]! < line) low = middle + 1;
    else high = middle;
  }
  if (low === timeline.length / 2) return timeline.at(-1) ?? 0;
  const [at, since] = [timeline[low * 2]!, timeline[low * 2 + 1]!];
  const [before, from] = low > 0 ? [timeline[low * 2 - 2]!, timeline[low * 2 - 1]!] : [0, 0];
  const share = at > before ? (line - before) / (at - before) : 1;
  return from + share * (since - from);
}

/** Of a job of which this much has run, with these overrides in %. Feeds and rapids have the shares of the whole job; dwells no override. */
export function secondsLeft(report: Pick<Report, "seconds" | "cutting_seconds" | "rapid_seconds">, spent: number, feed: number, rapid: number): number {
  const { seconds, cutting_seconds: cutting, rapid_seconds: rapids } = report;
  const now = seconds + cutting * (100 / feed - 1) + rapids * (100 / rapid - 1);
  return seconds > 0 ? (Math.max(0, seconds - spent) * now) / seconds : 0;
}
