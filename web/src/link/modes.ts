/** What a sequence of the page leaves as it was: work system, units, distance mode, feed and tool length. A reset forgets them. */
import { effect } from "@preact/signals";
import { settingNumber } from "../tables";
import type { Controller } from "./controller";

const REPORTS_IN_INCHES = settingNumber("report_inches");
const MM_PER_INCH = 25.4;
const HELD = new Set(["Hold", "Tool", "Door"]);

export interface Modes {
  line: string;
  length_mm: number;
  /** Of the controller, then. */
  resets: number;
}

export function lengthLine(mm: number): string {
  return `G21G43.1Z${Number(mm.toFixed(4))}`;
}

function length_mm(controller: Controller): number {
  const inInches = Number(controller.settings.peek().get(REPORTS_IN_INCHES) ?? 0) > 0;
  return Number(controller.offsets.peek().get("TLO")?.split(",")[0] ?? 0) * (inInches ? MM_PER_INCH : 1);
}

/** As the controller has reported them last. */
export function modesOf(controller: Controller): Modes {
  const all = controller.modes.peek().split(" ");
  const words = all.filter((word) => /^(G5[4-9](\.[123])?|G9[01]|G2[01]|G9[345])$/.test(word));
  const feed = all.filter((word) => /^F[\d.]+$/.test(word) && words.includes("G94"));
  return { line: ["G0", ...words, ...feed].join(""), length_mm: length_mm(controller), resets: controller.resets };
}

/** At rest, when a hold has ended, and only to a machine that is still this page's. @param before  lines that go first */
export async function giveBack(controller: Controller, kept: Modes, before: readonly string[] = []): Promise<void> {
  await outOfMotion(controller);
  if (!controller.commands.peek() || !controller.mayAsk() || controller.state.peek() !== "Idle") return;
  await controller.refresh("$#");
  if (length_mm(controller) === 0 && kept.length_mm !== 0) await controller.send(lengthLine(kept.length_mm));
  for (const line of [...before, kept.line]) await controller.send(line);
}

/** At rest, and in no hold: also behind the reset of a stop, before which the last report is. */
export async function outOfMotion(controller: Controller): Promise<void> {
  let isHeld = true;
  while (isHeld) {
    await outOfHold(controller);
    await controller.rest().catch(() => {});
    isHeld = controller.connected.peek() && HELD.has(controller.state.peek()) && !controller.operates.peek();
  }
}

/** A line that is sent into a hold would be executed behind it, in the middle of something else. A parked hold takes lines. */
export function outOfHold(controller: Controller): Promise<void> {
  return new Promise((resolve) => {
    const end = effect(() => {
      if (controller.link.value === "open" && HELD.has(controller.state.value) && !controller.operates.value) return;
      queueMicrotask(() => (end(), resolve()));
    });
  });
}
