/** A spindle that runs warm, at one speed after the other. */
import type { Controller } from "./controller";
import type { Stage } from "./fire";
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
    this.stopped = false;
    let failed = "";
    for (const [i, { rpm, time_s }] of stages.entries()) {
      this.tell(i, "");
      this.asks = true;
      const answer = await this.controller.post(`M3S${rpm}`);
      this.asks = false;
      if (answer.kind !== "ok") failed = answer.kind === "error" ? t`The controller has refused it: error ${answer.code}` : t`The connection was lost, or the controller was reset.`;
      else if (!this.stopped) await this.wait(time_s);
      if (this.stopped || failed) break;
    }
    // Run: the last report may be from while it ran up.
    if (!failed && ["Idle", "Run"].includes(this.controller.state.peek())) await this.controller.post("M5");
    this.stopped = true;
    this.tell(-1, failed);
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
