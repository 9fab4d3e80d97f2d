/** Lines that the network's server answers itself, before lines of the machine that wait: `$TRUST`. */
import type { Controller } from "./controller";

/** As controller.send(), when nothing else is under way, so that each answer is taken for its own line's. */
export async function sendAlone(controller: Controller, text: string): Promise<string[]> {
  while (!controller.queue.idle) await controller.post("", false); // an empty line is answered in its turn
  return controller.send(text);
}
