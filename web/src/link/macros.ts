/** Lines that the user has put on a button. Kept in the browser. Pure. */
import { readProgram } from "../job/program";

export interface Macro {
  name: string;
  lines: string;
}

export const MOST_MACROS = 24;
/** Lines that move nothing and wait for nothing: `$` lines but jogs and homing; spindle, coolant and their speeds. */
const RESTS = /^(?:\$(?![JH]).*|(?:M0*[345789](?!\d)|[STF][\d.]+)+)$/;

/** What goes to the controller. Throws ProgramError. */
export function macroLines({ name, lines }: Macro): string[] {
  return readProgram(name, lines).lines.map(({ code }) => code);
}

/** Whether it may move something; a macro that cannot be read does nothing. */
export function macroMoves(macro: Macro): boolean {
  try {
    return !macroLines(macro).every((line) => RESTS.test(line));
  } catch {
    return false;
  }
}

/** What the browser has kept, as far as it can be read. */
export function readMacros(text: string | null): Macro[] {
  try {
    const kept: unknown = JSON.parse(text ?? "[]");
    const isMacro = (row: unknown): row is Macro => typeof row === "object" && row !== null && typeof (row as Macro).name === "string" && typeof (row as Macro).lines === "string";
    return Array.isArray(kept) ? kept.filter(isMacro).slice(0, MOST_MACROS) : [];
  } catch {
    return [];
  }
}
