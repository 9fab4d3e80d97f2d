/**
 * Work zero by hand: an axis gets a value where it is, and can have its former one back. Everything in mm here; a machine
 * whose program is in inches returns to inches. Pure.
 */
import { AXES } from "../tables";

export const WORK_SYSTEMS = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"] as const;
const MM_PER_INCH = 25.4;

/** Of `$G`'s words. */
export function workSystemOf(modes: string): string {
  return modes.split(" ").find((word) => (WORK_SYSTEMS as readonly string[]).includes(word)) ?? "G54";
}

/** "Here is X 12.5": in the work system in force. */
export function placeLine(values_mm: Readonly<Record<string, number>>): string {
  return `G10L20P0${wordsOf(Object.entries(values_mm))}`;
}

/** The line that brings the offsets of these axes back. null: they were never reported, so there is no way back. */
export function undoLine(system: string, axes: readonly string[], offsets_mm: readonly number[] | undefined): string | null {
  const number = (WORK_SYSTEMS as readonly string[]).indexOf(system) + 1;
  const values = axes.map((axis) => [axis, offsets_mm?.[AXES.indexOf(axis)] ?? NaN] as const);
  if (number === 0 || values.some(([, value]) => !Number.isFinite(value))) return null;
  return `G10L2P${number}${wordsOf(values)}`;
}

/** What someone has typed for a position, in mm. null: no number. A decimal comma is a point. */
export function typedPosition(text: string, inInches: boolean): number | null {
  const trimmed = text.trim().replace(",", ".");
  if (!/^[-+]?(\d+\.?\d*|\.\d+)$/.test(trimmed)) return null;
  return Number(trimmed) * (inInches ? MM_PER_INCH : 1);
}

function wordsOf(values: readonly (readonly [string, number])[]): string {
  return values.map(([axis, value]) => `${axis}${Number(value.toFixed(4))}`).join("");
}
