/**
 * Jogging by hand. A step is one `$J=` line. While a button or key is held, short jogs follow each other a little ahead
 * of the machine; letting go cancels what is left (0x85), so that it stops within its acceleration.
 */
import { effect } from "@preact/signals";
import { AXES, errorWords, settingNumber } from "../tables";
import { t } from "../words";
import { RefusedError, type Controller } from "./controller";

/** A slice of held jogging, and how far the slices run ahead, ms. */
const SLICE_MS = 100;
const AHEAD_MS = 300;
/** Slices without an answer, at most: what a dead link keeps is executed when it is back. And how long it may be silent, ms. */
const MOST_OPEN = 6;
const STALLED_MS = 1000;
/** As near as a held jog comes to the end of the travel, mm or degrees. */
const CLOSE = 0.01;
/** The jog would leave the travel; it follows one that someone else has stopped. */
const OUTSIDE = 15;
const STOPPED = 184;
const MAX_RATE = settingNumber("max_rate_mm_min");
/** States in which it may continue: a report from before it says Idle. */
const KEEPS_JOGS = new Set(["Idle", "Jog"]);

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
}

export class Jogger {
  private held: Held | null = null;
  private timer: ReturnType<typeof setInterval> | undefined;
  private sentMs = 0;
  private startedAt = 0;
  private unwatch: () => void = () => {};
  /** Stops of the controller, at the last single step; null: its end is known. */
  private stepped: number | null = null;

  /** @param tell  why a jog does not continue, and what to do, in words */
  constructor(
    private readonly controller: Controller,
    private readonly tell: (why: string, hint?: string) => void = () => {},
  ) {
    controller.onJogStopped = () => this.hearStopped();
  }

  /** So far in these directions, mm or degrees; at this feed, mm/min. */
  async step(direction: Direction, distance: number, feed: number): Promise<void> {
    this.stepped = this.controller.stops;
    await this.controller.send(line(direction, distance, feed)).catch((error: unknown) => {
      if (!(error instanceof RefusedError && error.code === STOPPED)) throw error;
      this.tellStopped();
    });
  }

  /** Continue until this is let go, the end of the travel, a refusal, or a stop by anyone. @param by  the button, or the keys */
  begin(direction: Direction, feed: number, by: string): void {
    this.end();
    this.stepped = null;
    this.startedAt = performance.now();
    this.sentMs = 0;
    const held: Held = (this.held = { by, direction, feed, stops: this.controller.stops, open: 0, heardAt: this.startedAt });
    const more = (): void => {
      if (!this.isHeld(by)) return this.end();
      if (held.open >= MOST_OPEN && performance.now() - held.heardAt > STALLED_MS) return this.stall();
      const nowMs = performance.now() - this.startedAt;
      this.sentMs = Math.max(this.sentMs, nowMs); // what a page that stood still has not sent is not owed
      for (; this.sentMs < nowMs + AHEAD_MS && held.open < MOST_OPEN; this.sentMs += SLICE_MS) this.slice(held);
    };
    this.timer = setInterval(more, SLICE_MS / 2);
    more();
    const began = this.controller.state.peek(); // where it may not, the first slice is refused
    this.unwatch = effect(() => {
      const state = this.controller.state.value;
      if (state !== began && !KEEPS_JOGS.has(state) && !this.controller.operates.value) queueMicrotask(() => this.held === held && this.leave(state));
    });
  }

  /** Not stopped meanwhile, which a new press ends and nothing else. */
  isHeld(by: string): boolean {
    return this.held?.by === by && this.held.stops === this.controller.stops;
  }

  /** The machine has left the jog, by someone else or by an alarm, which has its own notice. */
  private leave(state: string): void {
    this.end();
    if (state !== "Alarm") this.tellStopped();
  }

  /** The controller has ended a jog that its owner did not stop. */
  private hearStopped(): void {
    const isOwn = this.held !== null || this.stepped === this.controller.stops;
    if (!isOwn || !this.controller.commands.peek()) return;
    this.end();
    this.tellStopped();
  }

  private tellStopped(): void {
    this.stepped = null;
    this.tell(t`Stopped by another client or at the machine`, t`Release the button or key for 0.5 s, then press it again.`);
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
    void this.controller.post(line(held.direction, distance, held.feed), false).then((answer) => {
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
        if (answer.kind === "error" && answer.code === STOPPED) this.tellStopped();
        else if (answer.kind === "error") this.tell(t`The jog was refused: error ${answer.code}, ${errorWords(answer.code)}`);
      }
    });
  }

  /** What is left to the end of the travel is shorter than a slice: halves of it, as long as they are accepted or not. */
  private async approach(held: Held, slice: number): Promise<void> {
    for (let part = slice / 2; part >= CLOSE / 2; part /= 2) {
      const answer = await this.controller.post(line(held.direction, part, held.feed), false);
      if (this.held !== held || answer.kind === "lost") return;
    }
    this.tell(t`End of the travel: ${Object.entries(held.direction).map(([axis, sign]) => `${axis}${sign > 0 ? "+" : "−"}`).join(" ")}`);
  }
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
