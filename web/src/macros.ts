/** Macros of this browser, and the one that runs. */
import { signal } from "@preact/signals";
import { controller, doing, job, move, store, stored } from "./app";
import { MacroRun } from "./link/macrorun";
import { readMacros, type Macro } from "./link/macros";
import { t } from "./words";

const KEY = "wificnc.macros";

export const macros = signal<readonly Macro[]>(readMacros(stored(KEY)));

const running = new MacroRun(controller, (line) => move(line), () => job.active.peek());

export function keepMacros(list: readonly Macro[]): void {
  macros.value = list;
  store(KEY, JSON.stringify(list));
}

/** Rejects with what went wrong. */
export async function runMacro(macro: Macro): Promise<void> {
  doing.value = t`The macro ${macro.name} is running: stop it, or wait until it is finished.`;
  try {
    await running.run(macro);
  } finally {
    doing.value = "";
  }
}

export function stopMacro(): void {
  running.stop();
}
