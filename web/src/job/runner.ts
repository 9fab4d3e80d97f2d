/** A job on its way through a controller: what was sent, what was answered, where it stands. */
import { computed, signal } from "@preact/signals";
import type { Controller } from "../link/controller";
import type { Status } from "../link/messages";
import { errorWords } from "../tables";
import type { JobLine, Program } from "./program";

export type JobState = "none" | "ready" | "running" | "stopping" | "done" | "stopped" | "failed" | "lost";

export class JobRunner {
  readonly program = signal<Program | null>(null);
  readonly state = signal<JobState>("none");
  /** Lines of the program, of those with code: sent, and answered. */
  readonly sent = signal(0);
  readonly answered = signal(0);
  /** Why it failed or stopped. */
  readonly why = signal("");
  readonly startedAt = signal(0);
  readonly endedAt = signal(0);
  readonly active = computed(() => this.state.value === "running" || this.state.value === "stopping");
  /** The line in the file that was answered last; 0: none. */
  readonly lastAnsweredLine = computed(() => this.lines.value[this.answered.value - 1]?.number ?? 0);

  private readonly lines = signal<readonly JobLine[]>([]);
  private run = 0;
  /** The report that was there when a `$` line came up: a newer one must say that nothing moves. */
  private reportBefore: Status | null = null;

  constructor(private readonly controller: Controller) {
    const room = controller.onRoom;
    controller.onRoom = () => {
      room();
      this.feed();
    };
    const broken = controller.onBreak;
    controller.onBreak = (what) => {
      broken(what);
      this.breakOff(what);
    };
  }

  load(program: Program): void {
    this.program.value = program;
    this.lines.value = program.lines;
    this.sent.value = this.answered.value = 0;
    this.why.value = "";
    this.state.value = "ready";
  }

  /** Send these lines: the whole program, or what a resume has planned. */
  start(lines: readonly JobLine[] | null = null): void {
    const program = this.program.value;
    if (!program || this.active.value) return;
    this.run++;
    this.lines.value = lines ?? program.lines;
    this.sent.value = this.answered.value = 0;
    this.why.value = "";
    this.startedAt.value = Date.now();
    this.state.value = "running";
    this.feed();
  }

  get total(): number {
    return this.lines.value.length;
  }

  /** Hold, wait until nothing moves, reset: so the position is kept. */
  stop(): void {
    if (this.state.value !== "running") return;
    this.state.value = "stopping";
    this.why.value ||= "stopped by hand";
    this.controller.realtime("HOLD");
    this.resetAtRest(this.controller.status.peek());
  }

  /** The report that is there was made before the hold: wait for a newer one that says that nothing moves. */
  private resetAtRest(old: Status | null): void {
    const end = this.controller.status.subscribe((status) => {
      if (status === old) return;
      const moves = status !== null && (status.state === "Run" || (status.state === "Hold" && status.substate === 1));
      if (this.state.peek() === "stopping" && moves) return;
      queueMicrotask(() => end());
      if (this.state.peek() === "stopping") this.controller.reset();
    });
  }

  /** Put lines while there is room; each is answered once. */
  private feed(): void {
    const lines = this.lines.value;
    while (this.state.value === "running" && this.sent.value < lines.length) {
      const line = lines[this.sent.value]!;
      if (!this.mayGo(line)) return;
      this.reportBefore = null;
      this.sent.value++;
      const run = this.run;
      void this.controller.post(line.code, false).then((answer) => {
        if (run !== this.run || answer.kind === "lost") return;
        this.answered.value++;
        if (answer.kind === "error") this.refuse(line, answer.code);
        else if (this.answered.value === lines.length && this.state.value === "running") this.finish("done", "");
      });
    }
  }

  /** `$` lines are refused while the machine moves, so they wait until all before them is made. */
  private mayGo(line: JobLine): boolean {
    const { queue, status } = this.controller;
    if (!line.code.startsWith("$")) return queue.hasRoom(line.code.length);
    if (!queue.idle) return false;
    this.reportBefore ??= status.peek();
    return status.peek() !== this.reportBefore && status.peek()?.state === "Idle";
  }

  private refuse(line: JobLine, code: number): void {
    if (this.state.value !== "running") return;
    this.why.value = `line ${line.number} (${line.text}): error ${code}, ${errorWords(code)}`;
    this.stop();
  }

  private breakOff(what: "reset" | "lost" | "closed"): void {
    if (!this.active.value) return;
    const at = this.lastAnsweredLine.value;
    const where = at ? `line ${at} was the last one acknowledged` : "no line was acknowledged";
    if (what !== "reset") this.finish("lost", `${this.controller.lostWhy.value || "the link has ended"}; ${where}`);
    else if (this.state.value === "stopping")
      this.finish(this.why.value === "stopped by hand" ? "stopped" : "failed", this.why.value);
    else this.finish("failed", `the controller was reset; ${where}`);
  }

  private finish(state: JobState, why: string): void {
    this.run++;
    this.why.value = why;
    this.endedAt.value = Date.now();
    this.state.value = state;
  }
}
