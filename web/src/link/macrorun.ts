/** The macro that runs: line by line, each when the one before was accepted, and none into a hold, until the machine rests. */
import type { Controller } from "./controller";
import { macroLines, macroMoves, type Macro } from "./macros";
import { giveBack, modesOf, outOfHold, outOfMotion } from "./modes";
import { t } from "../words";

export class MacroRun {
  private isStopped = false;
  private isParked = false;

  /** @param move  a jog, until the machine rests @param isBusy  a job runs */
  constructor(
    private readonly controller: Controller,
    private readonly move: (line: string) => Promise<void>,
    private readonly isBusy: () => boolean,
  ) {}

  /** Rejects with what went wrong. */
  async run(macro: Macro): Promise<void> {
    const kept = modesOf(this.controller);
    this.isParked = this.controller.operates.peek();
    this.isStopped = false;
    try {
      await this.lines(macro, kept.resets);
    } finally {
      if (this.isStopped && !this.isParked) await outOfMotion(this.controller);
      if (this.isStopped && this.controller.resets !== kept.resets) await giveBack(this.controller, kept).catch(() => {});
    }
  }

  stop(): void {
    this.isStopped = true;
    this.controller.stopMotion(this.isParked);
  }

  private async lines(macro: Macro, resets: number): Promise<void> {
    for (const [i, line] of macroLines(macro).entries()) {
      if (!this.isParked) await outOfHold(this.controller);
      const why = this.whyNot(macro.name, i + 1, line, resets);
      if (why) throw new Error(why);
      await (line.startsWith("$J=") ? this.move(line) : this.controller.send(line));
    }
    if (macroMoves(macro) && !this.isStopped) await this.controller.rest(); // an answer comes before the motion
  }

  /** Why the next line does not go; "": it does. */
  private whyNot(name: string, number: number, line: string, resets: number): string {
    const { commands, operates } = this.controller;
    if (this.isStopped) return t`${name}: stopped by hand before line ${number} (${line})`;
    if (this.controller.resets !== resets) return t`${name}: ended before line ${number} (${line}), because the controller was reset`;
    if (commands.peek() && !this.isBusy() && operates.peek() === this.isParked) return "";
    return t`${name}: ended before line ${number} (${line}), because the machine is not this page's any more`;
  }
}
