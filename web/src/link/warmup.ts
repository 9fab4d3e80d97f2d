/** A spindle that runs warm, at one speed after the other. */
import type { Controller } from "./controller";
import type { Stage } from "./fire";
import { giveBack, modesOf } from "./modes";
import { t } from "../words";

/** The spindle stops at the end, with Stop, with the dialog and when the state changes. */
export class WarmUp {
  private stopped = true;
  /** A speed is not confirmed yet: the spindle may be running up. */
  private asks = false;
  private wake: () => void = () => {};

  constructor(
    private readonly controller: Controller,
    private readonly tell: (stage: number, failed: string) => void,
  ) {}

  async run(stages: readonly Stage[]): Promise<void> {
    const [kept, stops] = [modesOf(this.controller), this.controller.stops];
    this.stopped = false;
    const failed = await this.turn(stages);
    const left = await this.end(kept.resets);
    this.stopped = true;
    this.tell(-1, left || failed);
    if (this.controller.stops !== stops) await giveBack(this.controller, kept).catch(() => {});
  }

  /** @returns what went wrong; "": nothing */
  private async turn(stages: readonly Stage[]): Promise<string> {
    for (const [i, { rpm, time_s }] of stages.entries()) {
      this.tell(i, "");
      this.asks = true;
      const answer = await this.controller.post(`M3S${rpm}`);
      this.asks = false;
      if (this.stopped) break;
      if (answer.kind === "error") return t`The controller has refused it: error ${answer.code}`;
      if (answer.kind === "lost") return t`The connection was lost, or the controller was reset.`;
      await this.wait(time_s);
      if (this.stopped) break;
    }
    return "";
  }

  /** Also after a stage that was refused: the one before may be on. @returns why it may not have stopped; "": it has */
  private async end(resets: number): Promise<string> {
    if (!["Idle", "Run"].includes(this.controller.state.peek())) return ""; // Run: the last report may be from while it ran up
    const answer = await this.controller.post("M5");
    if (answer.kind === "ok" || this.controller.resets !== resets) return "";
    return t`M5 was not accepted: the spindle may still be turning. Press Reset, or stop it at the machine.`;
  }

  /** A spindle that still runs up is stopped as a motion is. */
  stop(): void {
    if (this.stopped) return;
    this.stopped = true;
    this.wake();
    if (this.asks || this.controller.state.peek() !== "Idle") this.controller.stopMotion();
  }

  private wait(time_s: number): Promise<void> {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, time_s * 1000);
      this.wake = () => (clearTimeout(timer), resolve());
    });
  }
}
