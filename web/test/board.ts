/** A controller that is a few lines of test: every answer by hand, no clock. */
import { expect, vi } from "vitest";
import { Controller } from "../src/link/controller";
import type { Transport, TransportEvents } from "../src/link/transport";

/** Nothing takes this long, at any load. */
export const HANG = { timeout: 120_000 };

export class Board implements Transport {
  readonly name = "a test";
  sent = "";
  /** Reports that were asked for and not made yet. */
  private asked = 0;
  /** Full reports that were asked for, ever. */
  askedFully = 0;
  private events: TransportEvents | null = null;

  constructor(readonly isSerial = true) {}

  async open(events: TransportEvents): Promise<void> {
    this.events = events;
    queueMicrotask(() => this.says("<Idle|MPos:0.000,0.000,0.000>"));
  }
  async write(bytes: Uint8Array): Promise<void> {
    const text = new TextDecoder("latin1").decode(bytes);
    this.asked += text.split("?").length - 1;
    this.askedFully += text.split("\x87").length - 1;
    this.sent += text.replaceAll(/[?\x87]/g, "");
  }
  async close(): Promise<void> {}

  says(...lines: string[]): void {
    this.events!.bytes(new TextEncoder().encode(lines.map((line) => `${line}\r\n`).join("")));
  }
  lose(): void {
    this.events!.lost("unplugged");
  }
  /** A question for a report is on its way, or there already. */
  isAsked(): Promise<void> {
    return vi.waitFor(() => expect(this.asked).toBeGreaterThan(0), HANG);
  }
  /** The answer to the oldest question that has none. */
  async reports(text: string): Promise<void> {
    await this.isAsked();
    this.asked--;
    this.says(text);
    await turn();
  }
  /** What was sent since the last time. */
  heard(): string {
    const sent = this.sent;
    this.sent = "";
    return sent;
  }
}

/** Connected, and past the questions of the beginning. */
export async function connect(controller = new Controller(), board = new Board()): Promise<{ board: Board; controller: Controller }> {
  const open = controller.connect(board);
  for (const line of ["$I", "$$", "$#", "$G"]) {
    await turn();
    expect(board.heard()).toBe(`${line}\n`);
    board.says(...(line === "$I" ? ["[OPT:V,15,41]"] : []), "ok");
  }
  await open;
  return { board, controller };
}

/** Reports come from this state, and lines are answered, until a line is that one. @returns all lines that came */
export async function answerUntil(board: Board, report: string, last: string, answer: (line: string) => readonly string[]): Promise<string[]> {
  const lines: string[] = [];
  while (!lines.includes(last)) {
    const heard = board.heard().replaceAll(/[\x18\x85!]/g, "").split("\n").filter(Boolean);
    for (const line of heard) board.says(...answer(line));
    lines.push(...heard);
    if (heard.length === 0) await board.reports(report);
    await turn();
  }
  return lines;
}

/** Whatever waits for what was reported continues. */
export const turn = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));
