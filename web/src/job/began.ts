/** In which work system and with which offsets a job ran, and what of it is gone since. Pure. */
import { workSystemOf } from "../link/offsets";
import type { JobLine } from "./program";
import { t } from "../words";

/** As the controller reports them; "": it has not. */
export interface Began {
  /** Words of `$G` before the first line. */
  modes: string;
  /** Rows of `$#`: the tool length and the offset of G92, as they were last known while it ran. */
  length: string;
  shift: string;
}

export const UNKNOWN: Began = { modes: "", length: "", shift: "" };

/** Of what the browser has kept: another version of the page may have written it. */
export function beganOf(kept: unknown): Began {
  const found = (kept ?? {}) as Began;
  return Object.values({ ...UNKNOWN, ...found }).every((text) => typeof text === "string") ? { ...UNKNOWN, ...found } : UNKNOWN;
}

function isSet(row: string): boolean {
  return row.split(",").some((value) => Number(value) !== 0);
}

/** The work systems of then and now, where they differ; null: they do not, or are not known. */
export function otherSystem(began: Began, now: Began): { then: string; now: string } | null {
  if (began.modes === "" || now.modes === "") return null;
  const systems = { then: workSystemOf(began.modes), now: workSystemOf(now.modes) };
  return systems.then === systems.now ? null : systems;
}

/** Whether a program names its work system before it moves: then that of the machine does not matter. */
export function namesSystem(lines: readonly JobLine[]): boolean {
  const first = lines.find(({ code }) => /[XYZABC]|G5[4-9]/.test(code));
  return first !== undefined && /G5[4-9]/.test(first.code);
}

/** What a reset has discarded since, in words. */
export function discarded(began: Began, now: Began): string[] {
  const found: string[] = [];
  if (isSet(began.length) && !isSet(now.length))
    found.push(t`The tool length of the job (${began.length}) is not in force any more: a reset discards it. Measure the tool again, or set the work zero of Z.`);
  if (isSet(began.shift) && !isSet(now.shift)) found.push(t`The G92 offset of the job is not in force any more: a reset discards it. Set the work zero again.`);
  return found;
}
