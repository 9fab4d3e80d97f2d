/** Macros of this browser, and the one that runs. */
import { effect, signal } from "@preact/signals";
import { controller, doing, job, move, store, stored } from "./app";
import { macroLines, macroMoves, readMacros, type Macro } from "./link/macros";
import { t } from "./words";

const KEY = "wificnc.macros";
const HELD = new Set(["Hold", "Tool", "Door"]);

export const macros = signal<readonly Macro[]>(readMacros(stored(KEY)));

let isStopped = false;

export function keepMacros(list: readonly Macro[]): void {
  macros.value = list;
  store(KEY, JSON.stringify(list));
}

/** Line by line, each when the one before was accepted, and none into a hold, until the machine rests. Rejects with what
 * went wrong. */
export async function runMacro(macro: Macro): Promise<void> {
  const lines = macroLines(macro);
  const parked = controller.operates.peek();
  isStopped = false;
  doing.value = t`The macro ${macro.name} is running: stop it, or wait until it is finished.`;
  try {
    for (const [i, line] of lines.entries()) {
      if (!parked) await outOfHold();
      if (isStopped) throw new Error(t`${macro.name}: stopped by hand before line ${i + 1} (${line})`);
      if (!controller.commands.peek() || job.active.peek() || controller.operates.peek() !== parked)
        throw new Error(t`${macro.name}: ended before line ${i + 1} (${line}), because the machine is not this page's any more`);
      await (line.startsWith("$J=") ? move(line) : controller.send(line));
    }
    if (macroMoves(macro) && !isStopped) await controller.rest(); // an answer comes before the motion
  } finally {
    doing.value = "";
  }
}

export function stopMacro(): void {
  isStopped = true;
  controller.stopMotion();
}

/** A line that is sent into a hold would be executed behind it, in the middle of something else. */
function outOfHold(): Promise<void> {
  return new Promise((resolve) => {
    const end = effect(() => {
      if (controller.link.value === "open" && HELD.has(controller.state.value) && !controller.operates.value) return;
      queueMicrotask(() => (end(), resolve()));
    });
  });
}
