/**
 * A job on its way through a controller. An answer says that a line was taken into the look-ahead, seconds before it is
 * cut: how far the job is, is what reports name as being moved (`Ln:`), and it is done when the machine rests after that.
 */
import { computed, signal } from "@preact/signals";
import type { Break, Controller } from "../link/controller";
import type { Status } from "../link/messages";
import { alarmWords, errorWords } from "../tables";
import { shownComment, writtenComment } from "../link/line";
import { UNKNOWN, type Began } from "./began";
import { longestLine, numbered, type JobLine, type Program } from "./program";
import { t } from "../words";

export type JobState = "none" | "ready" | "running" | "stopping" | "done" | "stopped" | "failed" | "lost" | "left" | "taken" | "restarted";

const HELD = new Set(["Hold", "Door"]);
/** Ended before its last line, so that a resume could follow. */
export const INTERRUPTED: ReadonlySet<JobState> = new Set(["lost", "stopped", "failed", "left", "taken", "restarted"]);
const AT_REST = new Set(["Idle", "Check"]);
/** Reports in a row from one place, after which the machine is at rest. */
const RESTING_REPORTS = 2;

export class JobRunner {
  readonly program = signal<Program | null>(null);
  readonly state = signal<JobState>("none");
  /** Lines of the program, of those with code: sent, answered, and moved to their end. */
  readonly sent = signal(0);
  readonly answered = signal(0);
  readonly executed = signal(0);
  /** The line in the file that is being moved, or was when it was last heard of; 0: none yet. */
  readonly currentLine = signal(0);
  /** Where a resume would begin: the line being moved, or the first one of those sent while none of them is; of a finished job, its first. */
  readonly resumeLine = computed(() => {
    const isDone = this.state.value === "done";
    const lines = isDone ? (this.program.value?.lines ?? []) : this.lines.value;
    const first = lines.find((line) => line.number > 0)?.number ?? 1;
    return isDone ? first : this.currentLine.value || first;
  });
  /** Why it failed or stopped. */
  readonly why = signal("");
  readonly startedAt = signal(0);
  readonly endedAt = signal(0);
  /** In what it ran, of a job that has been started. */
  readonly began = signal<Began>(UNKNOWN);
  /** What the program says to the operator: the last of its comments that the controller has shown. */
  readonly says = signal("");
  readonly active = computed(() => this.state.value === "running" || this.state.value === "stopping");
  /** It has been run: what starts it again is a decision of its own. */
  readonly ended = computed(() => this.state.value === "done" || INTERRUPTED.has(this.state.value));

  private readonly lines = signal<readonly JobLine[]>([]);
  private indexOf: ReadonlyMap<number, number> = new Map();
  /** As the controller shows them, in ASCII, and as they are written. */
  private comments: ReadonlyMap<string, string> = new Map();
  private run = 0;
  /** The user has stopped it, and nothing had gone wrong before. */
  private byHand = false;
  /** The report that was there when a `$` line came up: a newer one must say that nothing moves. */
  private reportBefore: Status | null = null;
  /** The line that reports still name from before this run; null: they name this run's. */
  private staleLine: number | null = null;
  private restingReports = 0;
  private restingPlace = "";

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
    controller.onReport = (status) => this.hear(status);
    controller.onAlarm = (code) => this.hearAlarm(code);
    controller.onMessage = (text) => {
      if (this.active.peek()) this.says.value = this.comments.get(text) ?? this.says.peek();
    };
  }

  /** Work system and offsets, as the controller has reported them last. */
  standsIn(): Began {
    const { modes, offsets } = this.controller;
    return { modes: modes.peek(), length: offsets.peek().get("TLO") ?? "", shift: offsets.peek().get("G92") ?? "" };
  }

  load(program: Program): void {
    this.program.value = program;
    this.began.value = UNKNOWN;
    this.take(program.lines);
    this.state.value = "ready";
  }

  /** A job of before a reload: it is as it was left, and nothing is sent. */
  restore(program: Program, state: JobState, line: number, why: string, began = UNKNOWN): void {
    this.load(program);
    if (state === "ready") return;
    this.began.value = began;
    this.currentLine.value = line;
    this.executed.value = Math.max(0, program.lines.findIndex((entry) => entry.number >= line));
    this.state.value = state;
    this.why.value = why;
  }

  unload(): void {
    this.program.value = null;
    this.take([]);
    this.state.value = "none";
  }

  /** Send these lines: the whole program, or what a resume has planned. */
  start(lines: readonly JobLine[] | null = null): void {
    const program = this.program.value;
    if (!program || this.active.value) return;
    this.run++;
    this.take(lines ?? program.lines);
    this.staleLine = this.controller.status.peek()?.line ?? null;
    this.startedAt.value = Date.now();
    if (lines === null || this.began.value.modes === "") this.began.value = this.standsIn(); // a resume runs in what the job had
    this.state.value = "running";
    this.feed();
  }

  get total(): number {
    return this.lines.value.length;
  }

  /** Hold, wait until nothing moves, reset: so the position is kept. */
  stop(): void {
    if (this.state.value !== "running") return;
    if (!this.controller.resetAtRest(() => this.state.peek() === "stopping")) return; // not sent: it runs, and can be stopped
    this.state.value = "stopping";
    this.byHand = this.why.value === "";
    if (this.byHand) this.why.value = t`stopped by hand`;
  }

  private take(lines: readonly JobLine[]): void {
    this.lines.value = lines;
    this.indexOf = new Map(lines.map((line, i) => [line.number, i]));
    this.sent.value = this.answered.value = this.executed.value = this.currentLine.value = 0;
    this.restingReports = 0;
    this.why.value = this.says.value = "";
    this.comments = new Map(lines.flatMap(({ comment, text, code }) => (comment ? [[shownComment(comment), writtenComment(text, code)]] : [])));
  }

  /** Put lines while there is room; each is answered once. */
  private feed(): void {
    const lines = this.lines.value;
    while (this.state.value === "running" && this.sent.value < lines.length) {
      const line = lines[this.sent.value]!;
      const wire = numbered(line, longestLine(this.controller.queue.capacity + 1));
      if (!this.mayGo(wire)) return;
      this.reportBefore = null;
      this.sent.value++;
      const run = this.run;
      void this.controller.post(wire, false).then((answer) => {
        if (run !== this.run || answer.kind === "lost") return;
        this.answered.value++;
        this.restingReports = 0;
        if (answer.kind === "error") this.refuse(line, answer.code);
      });
    }
  }

  /** `$` lines are refused while the machine moves, so they wait until all before them is made. */
  private mayGo(wire: string): boolean {
    const { queue, status } = this.controller;
    if (HELD.has(status.peek()?.state ?? "")) return false; // the room that is left is the operator's
    if (!wire.startsWith("$")) return queue.hasRoom(wire.length);
    if (!queue.idle) return false;
    this.reportBefore ??= status.peek();
    return status.peek() !== this.reportBefore && status.peek()?.state === "Idle";
  }

  private hear(status: Status): void {
    if (!this.active.peek()) return;
    this.hearLine(status.line);
    this.followOffsets();
    if (status.state === "Alarm") this.finish("failed", t`the machine is locked; ${this.where()}`);
    const place = `${status.state} ${String(status.mpos ?? status.wpos)}`;
    this.restingReports = place === this.restingPlace ? this.restingReports + 1 : 1;
    this.restingPlace = place;
    const all = this.answered.peek() === this.lines.peek().length && this.state.peek() === "running";
    if (all && AT_REST.has(status.state) && this.restingReports >= RESTING_REPORTS) this.finish("done", "");
  }

  /** The operator may measure a tool while the job is parked. */
  private followOffsets(): void {
    const [began, { length, shift }] = [this.began.peek(), this.standsIn()];
    if (began.length !== length || began.shift !== shift) this.began.value = { ...began, length, shift };
  }

  /** Lines before the one that is named are made. Without names (no `Ln:`), nothing is known before the end. */
  private hearLine(line: number | null): void {
    if (line === this.staleLine) return;
    this.staleLine = null;
    const index = line === null ? undefined : this.indexOf.get(line);
    if (line === null || index === undefined || index >= this.sent.peek() || index < this.executed.peek()) return;
    this.executed.value = index;
    this.currentLine.value = line;
  }

  private hearAlarm(code: number): void {
    if (this.active.peek()) this.finish("failed", t`alarm ${code}, ${alarmWords(code)}; ${this.where()}`);
  }

  private refuse(line: JobLine, code: number): void {
    if (this.state.value !== "running") return;
    this.why.value = t`line ${line.number} (${line.text}): error ${code}, ${errorWords(code)}`;
    this.stop();
  }

  private breakOff(what: Break): void {
    if (what === "restarted") return this.loseMachine();
    if (!this.active.value) return;
    if (what === "taken") this.finish("taken", t`${this.controller.takenBy.value || t`Another client`} took control; ${this.where()}`);
    else if (what !== "reset") this.finish("lost", `${this.controller.lostWhy.value || t`the connection was closed`}; ${this.where()}`);
    else if (this.state.value === "stopping")
      this.finish(this.byHand ? "stopped" : "failed", this.why.value);
    else this.finish("failed", t`the controller was reset; ${this.where()}`);
  }

  /** Also of a job that had ended before: nothing can be resumed at a place that is not known. */
  private loseMachine(): void {
    if (this.active.peek() || INTERRUPTED.has(this.state.peek())) this.finish("restarted", this.where());
  }

  private where(): string {
    const line = this.currentLine.peek();
    return line ? t`line ${line} was being executed` : t`no executed line was reported`;
  }

  private finish(state: JobState, why: string): void {
    this.run++;
    this.why.value = why;
    this.endedAt.value = Date.now();
    if (state === "done") {
      this.executed.value = this.lines.peek().length;
      this.currentLine.value = this.lines.peek().at(-1)?.number ?? 0;
    }
    this.state.value = state;
  }
}
