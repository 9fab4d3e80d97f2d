/** The laser at rest: lit, and dark again with the words of the program as they were. */
import type { Controller } from "./controller";
import { darkLines } from "./fire";
import { t } from "../words";

/** In which M5 must be accepted. */
const ANSWER_MS = 1000;

/** One beam at a time: what was lit is dark before the next one, and has given back the words of the program. */
export class Beam {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private modes: string | null = null;
  /** The press that lights, or waits for its turn; null: let go. */
  private press: object | null = null;
  private dark = Promise.resolve();

  constructor(
    private readonly controller: Controller,
    private readonly tell: (lit: boolean, failed: string) => void,
  ) {}

  async light(line: string, time_s: number): Promise<void> {
    if (this.press) return;
    const press = (this.press = {});
    await this.dark;
    await this.controller.known("$G");
    if (this.press !== press) return;
    this.modes = this.controller.modes.peek();
    this.timer = setTimeout(() => this.end(), time_s * 1000);
    this.tell(true, "");
    const answer = await this.controller.post(line);
    if (answer.kind === "ok") return;
    this.end();
    this.tell(false, answer.kind === "error" ? t`The controller has refused it: error ${answer.code}` : t`The connection was lost: the controller ends the beam.`);
  }

  end(): void {
    const modes = this.modes;
    this.press = null;
    if (modes === null) return;
    clearTimeout(this.timer);
    this.modes = null;
    this.tell(false, "");
    if (this.controller.connected.peek()) this.dark = this.darken(modes);
  }

  /** M5 is accepted in time, or else the controller is reset: everyone may do that. All lines go together: none
   * comes in between. */
  private async darken(modes: string): Promise<void> {
    const late = setTimeout(() => this.controller.reset(), ANSWER_MS);
    const [off, ...words] = darkLines(modes).map((line) => this.controller.post(line));
    const answer = await off!;
    clearTimeout(late);
    if (answer.kind === "error") this.controller.reset();
    await Promise.all(words);
  }
}
