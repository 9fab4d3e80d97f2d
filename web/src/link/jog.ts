/**
 * Jogging by hand. A step is one `$J=` line. While a button or key is held, short jogs follow each other a little ahead
 * of the machine; letting go cancels what is left (0x85), so that it stops within its acceleration.
 */
import { effect } from "@preact/signals";
import { AXES, errorWords, settingNumber } from "../tables";
import { t } from "../words";
import type { Controller } from "./controller";

/** A slice of held jogging, and how far the slices run ahead, ms. */
const SLICE_MS = 100;
const AHEAD_MS = 300;
/** Slices without an answer, at most: what a dead link keeps is executed when it is back. And how long it may be silent, ms. */
const MOST_OPEN = 6;
const STALLED_MS = 1000;
/** As near as a held jog comes to the end of the travel, mm or degrees. */
const CLOSE = 0.01;
/** The jog would leave the travel. */
const OUTSIDE = 15;
const MAX_RATE = settingNumber("max_rate_mm_min");
const STEPS_PER_MM = settingNumber("steps_per_mm");
const REPORTS_IN_INCHES = settingNumber("report_inches");
/** Slices end at the end of the travel by themselves. */
const CLAMPS = settingNumber("jog_clamp");
const MM_PER_INCH = 25.4;
const LINEAR = 3;
/** Of positions in reports, mm. And a step that is not known, mm. */
const ROUNDING = 0.005;
const USUAL_STEP = 0.02;

export type Direction = Readonly<Record<string, number>>;

interface Held {
  /** Whatever is held down. */
  by: string;
  direction: Direction;
  feed: number;
  /** Of the controller, when it was pressed. */
  stops: number;
  /** Slices without an answer, and since when the last answer came. */
  open: number;
  heardAt: number;
  /** Where it began, mm; null: that is not known for sure. */
  from: readonly number[] | null;
  /** Way of the accepted slices along each axis, mm. */
  accepted: number;
}

export class Jogger {
  private held: Held | null = null;
  private timer: ReturnType<typeof setInterval> | undefined;
  private sentMs = 0;
  private startedAt = 0;
  private unwatch: () => void = () => {};
  /** Lines without an answer; and the report that was the last one when one was answered: the place in it is old. */
  private pending = 0;
  private oldReport: unknown = null;

  /** @param tell  why a held jog does not continue, in words */
  constructor(
    private readonly controller: Controller,
    private readonly tell: (why: string) => void = () => {},
  ) {}

  /** So far in these directions, mm or degrees; at this feed, mm/min. */
  async step(direction: Direction, distance: number, feed: number): Promise<void> {
    await this.answered(this.controller.send(line(direction, distance, feed)));
  }

  /** Continue until this is let go, the end of the travel, a refusal, or a stop by anyone. @param by  the button, or the keys */
  begin(direction: Direction, feed: number, by: string): void {
    this.end();
    this.startedAt = performance.now();
    this.sentMs = 0;
    const held: Held = (this.held = { by, direction, feed, stops: this.controller.stops, open: 0, heardAt: this.startedAt, from: this.restPlace(), accepted: 0 });
    const more = (): void => {
      if (!this.isHeld(by)) return this.end();
      if (held.open >= MOST_OPEN && performance.now() - held.heardAt > STALLED_MS) return this.stall();
      const nowMs = performance.now() - this.startedAt;
      this.sentMs = Math.max(this.sentMs, nowMs); // what a page that stood still has not sent is not owed
      for (; this.sentMs < nowMs + AHEAD_MS && held.open < MOST_OPEN; this.sentMs += SLICE_MS) this.slice(held);
    };
    this.timer = setInterval(more, SLICE_MS / 2);
    more();
    const before = this.controller.status.peek();
    const unwatch = effect(() => {
      const [status, state] = [this.controller.status.value, this.controller.state.value];
      if (status !== before || state === "Alarm") queueMicrotask(() => this.held === held && this.look(held, state));
    });
    this.unwatch = unwatch;
  }

  /** Not stopped meanwhile, which a new press ends and nothing else. */
  isHeld(by: string): boolean {
    return this.held?.by === by && this.held.stops === this.controller.stops;
  }

  /** A report, or an alarm: whether it was stopped by anyone else. */
  private look(held: Held, state: string): void {
    if (held.stops !== this.controller.stops) return this.end();
    if (this.isAtRest() ? this.isShort(held) : state !== "Jog" && !this.controller.operates.peek()) this.stopped(state === "Alarm" ? "" : STOPPED());
  }

  /** An alarm has its own notice. */
  private stopped(why: string): void {
    this.end();
    if (why) this.tell(why);
  }

  private isAtRest(): boolean {
    const { state, operates, status } = this.controller;
    return operates.peek() ? status.peek()?.substate !== 1 : state.peek() === "Idle";
  }

  /** At rest before all that was accepted is moved: the rest was discarded. */
  private isShort({ from, accepted, direction }: Held): boolean {
    const settings = this.controller.settings.peek();
    if (from === null || Number(settings.get(CLAMPS) ?? 0) > 0) return false;
    const now = this.place();
    return Object.entries(direction).some(([axis, sign]) => {
      const i = AXES.indexOf(axis);
      const step = 1 / Number(settings.get(STEPS_PER_MM + i) ?? 1 / USUAL_STEP);
      return sign * (now[i]! - from[i]!) < accepted - ROUNDING - step;
    });
  }

  /** mm, and degrees of rotary axes. */
  private place(): number[] {
    const unit = Number(this.controller.settings.peek().get(REPORTS_IN_INCHES) ?? 0) > 0 ? MM_PER_INCH : 1;
    return this.controller.machinePosition.peek().map((value, i) => (i < LINEAR ? value * unit : value));
  }

  private restPlace(): number[] | null {
    const isOld = this.pending > 0 || this.controller.status.peek() === this.oldReport;
    return isOld || !this.isAtRest() ? null : this.place();
  }

  private async answered<Answer>(line: Promise<Answer>): Promise<Answer> {
    this.pending++;
    return line.finally(() => {
      this.pending--;
      this.oldReport = this.controller.status.peek();
    });
  }

  private stall(): void {
    this.end();
    this.tell(t`The controller did not answer for ${STALLED_MS / 1000} s: the jog has ended.`);
  }

  /** Let go. @param by  only what this one has begun: a button that loses the focus to another one ends nothing of that */
  end(by = this.held?.by): void {
    if (this.held === null || this.held.by !== by) return;
    clearInterval(this.timer);
    this.unwatch();
    this.held = null;
    this.controller.realtime("JOG_CANCEL");
  }

  private slice(held: Held): void {
    held.open++;
    const distance = ((held.feed / 60_000) * SLICE_MS) / Math.sqrt(Object.keys(held.direction).length);
    void this.answered(this.controller.post(line(held.direction, distance, held.feed), false)).then((answer) => {
      if (answer.kind === "ok") held.accepted += Number(round(distance));
      held.open--;
      held.heardAt = performance.now();
      if (answer.kind === "ok" || this.held !== held) return;
      const timer = this.timer;
      this.timer = undefined; // the slices behind the first refused one are refused as well
      if (timer === undefined) return;
      clearInterval(timer);
      if (answer.kind === "error" && answer.code === OUTSIDE) void this.approach(held, distance);
      else {
        this.end();
        if (answer.kind === "error") this.tell(refusedWords(answer.code, held.accepted > 0));
      }
    });
  }

  /** What is left to the end of the travel is shorter than a slice: halves of it, as long as they are accepted or not. */
  private async approach(held: Held, slice: number): Promise<void> {
    for (let part = slice / 2; part >= CLOSE / 2; part /= 2) {
      const answer = await this.answered(this.controller.post(line(held.direction, part, held.feed), false));
      if (answer.kind === "ok") held.accepted += Number(round(part));
      if (this.held !== held || answer.kind === "lost") return;
    }
    this.tell(t`End of the travel: ${Object.entries(held.direction).map(([axis, sign]) => `${axis}${sign > 0 ? "+" : "−"}`).join(" ")}`);
  }
}

const STOPPED = (): string => t`The movement was stopped by another client or at the machine. Release the button and press it again to continue.`;

/** A jog that has moved is refused because someone stopped it. */
function refusedWords(code: number, hasMoved: boolean): string {
  const words = t`The jog was refused: error ${code}, ${errorWords(code)}`;
  return hasMoved ? `${STOPPED()} ${words}` : words;
}

/** No axis of a held jog is asked for more than its fastest feed: what it cannot move would pile up. */
export function heldFeed(direction: Direction, feed: number, settings: ReadonlyMap<number, string>): number {
  const rates = Object.keys(direction).map((axis) => Number(settings.get(MAX_RATE + AXES.indexOf(axis)) ?? 0));
  return Math.min(feed, ...rates.filter((rate) => rate > 0));
}

/** Directions of all keys that are down: two that are opposed stand still. */
export function combined(directions: Iterable<Direction>): Direction {
  const sum: Record<string, number> = {};
  for (const direction of directions) for (const [axis, sign] of Object.entries(direction)) sum[axis] = (sum[axis] ?? 0) + sign;
  return Object.fromEntries(Object.entries(sum).filter(([, sign]) => sign !== 0));
}

/** The distance is along each axis, as on every pendant. */
function line(direction: Direction, distance: number, feed: number): string {
  const words = Object.entries(direction).map(([axis, sign]) => `${axis}${round(sign * distance)}`);
  return `$J=G91G21${words.join("")}F${round(feed)}`;
}

function round(value: number): string {
  return String(Number(value.toFixed(4)));
}
