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

export class LineQueue {
  /** Bytes that may be under way. */
  capacity = SMALLEST_BUFFER;
  private readonly waiting: Queued[] = [];
  private readonly underWay: { line: Queued; size: number; said: string[] }[] = [];
  private bytes = 0;

  get idle(): boolean {
    return this.waiting.length === 0 && this.underWay.length === 0;
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
    return this.underWay[0]?.line.quiet ?? false;
  }

  put(line: Queued): void {
    this.waiting.push(line);
  }

  /** Bytes that may be sent now, and from now on count as sent. */
  take(): string {
    let data = "";
    for (let line = this.waiting[0]; line !== undefined && this.mayGo(line); line = this.waiting[0]) {
      this.waiting.shift();
      const size = line.text.length + 1;
      this.underWay.push({ line, size, said: [] });
      this.bytes += size;
      data += `${line.text}\n`;
    }
    return data;
  }

  /** Room for one more line of this length, with nothing waiting before it. */
  hasRoom(length: number): boolean {
    return this.waiting.length === 0 && (this.underWay.length === 0 || this.bytes + length + 1 <= this.capacity);
  }

  /** A line that is not an answer belongs to the line that is being answered. */
  hear(text: string): void {
    this.underWay[0]?.said.push(text);
  }

  /** "ok", or an error. @returns false when no line is under way: someone else's. */
  answer(code: number | null): boolean {
    const first = this.underWay.shift();
    if (!first) return false;
    this.bytes -= first.size;
    first.line.settle(
      code === null ? { kind: "ok", said: first.said } : { kind: "error", code, said: first.said },
    );
    return true;
  }

  /** The controller was reset or the link is gone: no answers will come. */
  forget(): void {
    const lost = [...this.underWay.splice(0).map((entry) => entry.line), ...this.waiting.splice(0)];
    this.bytes = 0;
    for (const line of lost) line.settle({ kind: "lost" });
  }

  /** A line longer than the buffer goes alone: the link itself holds it back. */
  private mayGo(line: Queued): boolean {
    return this.underWay.length === 0 || this.bytes + line.text.length + 1 <= this.capacity;
  }
}
