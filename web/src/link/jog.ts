/**
 * Jogging by hand. A step is one `$J=` line. While a button or key is held, short jogs follow each other a little ahead
 * of the machine; letting go cancels what is left (0x85), so that it stops within its acceleration.
 */
import type { Controller } from "./controller";

/** A slice of held jogging, and how far the slices run ahead, ms. */
const SLICE_MS = 100;
const AHEAD_MS = 300;

export type Direction = Readonly<Record<string, number>>;

export class Jogger {
  private timer: ReturnType<typeof setInterval> | undefined;
  private sentMs = 0;
  private startedAt = 0;

  constructor(private readonly controller: Controller) {}

  /** So far in these directions, mm or degrees; at this feed, mm/min. */
  async step(direction: Direction, distance: number, feed: number): Promise<void> {
    await this.controller.send(line(direction, distance, feed));
  }

  /** Continue until end(). */
  begin(direction: Direction, feed: number): void {
    this.end();
    this.startedAt = performance.now();
    this.sentMs = 0;
    const more = (): void => {
      const nowMs = performance.now() - this.startedAt;
      this.sentMs = Math.max(this.sentMs, nowMs); // what a page that stood still has not sent is not owed
      for (; this.sentMs < nowMs + AHEAD_MS; this.sentMs += SLICE_MS) this.slice(direction, feed);
    };
    this.timer = setInterval(more, SLICE_MS / 2);
    more();
  }

  /** Let go. */
  end(): void {
    if (this.timer === undefined) return;
    clearInterval(this.timer);
    this.timer = undefined;
    this.controller.realtime("JOG_CANCEL");
  }

  /** A refused slice, such as one that would leave the travel, ends the jog. */
  private slice(direction: Direction, feed: number): void {
    const distance = (feed / 60_000) * SLICE_MS;
    void this.controller.post(line(direction, distance, feed), false).then((answer) => {
      if (answer.kind !== "ok") this.end();
    });
  }
}

/** The distance is along each axis, as on every pendant. */
function line(direction: Direction, distance: number, feed: number): string {
  const words = Object.entries(direction).map(([axis, sign]) => `${axis}${round(sign * distance)}`);
  return `$J=G91G21${words.join("")}F${round(feed)}`;
}

function round(value: number): string {
  return String(Number(value.toFixed(4)));
}
