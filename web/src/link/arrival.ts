/** Whether a jog has come to its end: Hold, the machine's own hold button and other clients cancel it, and its answer came long before. Pure. */
import { AXES, settingNumber } from "../tables";

/** mm or degrees. */
export interface Place {
  machine_mm: readonly number[];
  /** The work offset in effect. */
  origin_mm: readonly number[];
  settings: ReadonlyMap<number, string>;
}

const STEPS = settingNumber("steps_per_mm");
/** Of what reports round, twice. */
const ROUNDING_MM = 0.02;

/** @param line  a `$J=` line with G21; any other has arrived @param before  when it was sent @param after  when the machine rests */
export function hasArrived(line: string, before: Place, after: Place): boolean {
  if (!line.startsWith("$J=")) return true;
  const words = [...line.slice(3).matchAll(/([A-Z])(-?[\d.]+)/g)].map(([, letter, value]) => [letter!, Number(value)] as const);
  const has = (code: number): boolean => words.some(([letter, value]) => letter === "G" && value === code);
  return !has(21) || words.every(([letter, value]) => {
    const axis = AXES.indexOf(letter);
    if (axis < 0) return true;
    const from_mm = has(91) ? before.machine_mm[axis]! : has(53) ? 0 : (before.origin_mm[axis] ?? 0);
    const step_mm = 1 / (Number(after.settings.get(STEPS + axis)) || Infinity);
    return Math.abs(from_mm + value - after.machine_mm[axis]!) <= ROUNDING_MM + step_mm;
  });
}
