/**
 * Lines on their way to a controller, by character counting: every byte that was sent and not yet answered may still
 * lie in its receive buffer, so their sum stays within what it has. Each answer belongs to the oldest line under way.
 * Pure: knows no link and no clock.
 */

export interface Queued {
  /** Without its line end; no real-time bytes. */
  text: string;
  /** Asked by the page itself: what it answers is not for the terminal. */
  quiet?: boolean;
  /** The controller has answered, or never will. */
  settle(answer: Answer): void;
}

export type Answer =
  | { kind: "ok"; said: string[] }
  | { kind: "error"; code: number; said: string[] }
  | { kind: "lost" };

/** A controller that does not say how much it takes has Grbl's 128, and one is kept free. */
export const SMALLEST_BUFFER = 120;
/** Of a larger buffer, a job leaves this to the operator, whose lines in a parked hold come on top of the job's. */
const OPERATOR_BYTES = 256;
const HAS_OPERATOR_BYTES = 512;

function isJog(line: Queued): boolean {
  return /^\s*\$J=/i.test(line.text);
}

interface Sent {
  line: Queued;
  size: number;
  said: string[];
}

export class LineQueue {
  /** Bytes that may be under way. */
  capacity = SMALLEST_BUFFER;
  private readonly waiting: Queued[] = [];
  private readonly underWay: Sent[] = [];
  /** The operator's, in a parked hold: read and answered before all that is under way. */
  private readonly asideWaiting: Queued[] = [];
  private readonly aside: Sent[] = [];
  private isParked = false;
  private bytes = 0;

  get idle(): boolean {
    const isAsideIdle = this.asideWaiting.length === 0 && this.aside.length === 0;
    return isAsideIdle && (this.isParked || (this.waiting.length === 0 && this.underWay.length === 0));
  }

  /** From now on lines are the operator's; those under way are answered after the hold. */
  park(): void {
    this.isParked = true;
  }

  /** Lines are the job's again. What the operator has sent is still answered first; what is not sent never goes. */
  unpark(): void {
    this.isParked = false;
    for (const line of this.asideWaiting.splice(0)) line.settle({ kind: "lost" });
  }

  /** Lines sent and not yet answered. */
  get unanswered(): number {
    return this.underWay.length;
  }

  get backlog(): number {
    return this.waiting.length;
  }

  /** Whether what is heard now belongs to a question of the page itself. */
  get answersQuietly(): boolean {
    return this.answered?.line.quiet ?? false;
  }

  put(line: Queued): void {
    (this.isParked ? this.asideWaiting : this.waiting).push(line);
  }

  /** Jogs that were not sent yet never go. */
  callOffJogs(): void {
    for (const waiting of [this.asideWaiting, this.waiting]) {
      const all = waiting.splice(0);
      waiting.push(...all.filter((line) => !isJog(line)));
      for (const line of all.filter(isJog)) line.settle({ kind: "lost" });
    }
  }

  /** Bytes that may be sent now, and from now on count as sent. */
  take(): string {
    let data = "";
    const [waiting, underWay] = this.isParked ? [this.asideWaiting, this.aside] : [this.waiting, this.underWay];
    for (let line = waiting[0]; line !== undefined && this.mayGo(line); line = waiting[0]) {
      waiting.shift();
      const size = line.text.length + 1;
      underWay.push({ line, size, said: [] });
      this.bytes += size;
      data += `${line.text}\n`;
    }
    return data;
  }

  /** Room for one more line of a job, with nothing waiting before it. */
  hasRoom(length: number): boolean {
    if (this.isParked || this.waiting.length > 0) return false;
    const capacity = this.capacity > HAS_OPERATOR_BYTES ? this.capacity - OPERATOR_BYTES : this.capacity;
    return this.underWay.length === 0 || this.bytes + length + 1 <= capacity;
  }

  /** A line that is not an answer belongs to the line that is being answered. */
  hear(text: string): void {
    this.answered?.said.push(text);
  }

  /** "ok", or an error. @returns false when no line is under way: someone else's. */
  answer(code: number | null): boolean {
    const first = this.aside.shift() ?? this.underWay.shift();
    if (!first) return false;
    this.bytes -= first.size;
    first.line.settle(
      code === null ? { kind: "ok", said: first.said } : { kind: "error", code, said: first.said },
    );
    return true;
  }

  /** The controller was reset or the link is gone: no answers will come. */
  forget(): void {
    const sent = [...this.aside.splice(0), ...this.underWay.splice(0)].map((entry) => entry.line);
    const lost = [...sent, ...this.asideWaiting.splice(0), ...this.waiting.splice(0)];
    this.bytes = 0;
    this.isParked = false;
    for (const line of lost) line.settle({ kind: "lost" });
  }

  /** The line that the next answer belongs to. */
  private get answered(): Sent | undefined {
    return this.aside[0] ?? this.underWay[0];
  }

  /** A line longer than the buffer goes alone: the link itself holds it back. */
  private mayGo(line: Queued): boolean {
    return (this.underWay.length === 0 && this.aside.length === 0) || this.bytes + line.text.length + 1 <= this.capacity;
  }
}
