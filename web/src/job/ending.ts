/**
 * Where a program ends in its file: at M2 or M30, or at the % that closes it (RS274/NGC 3.6.1). The rule of
 * targets/sim/program_end.h; protocol/vectors/program_end.json binds them. Pure.
 */
import { t } from "../words";

const PERCENT = /^(?:N\d+)?%$/;
const NUMBER = /^(?:N\d+)?[O:]\d+$/;
/** M2 or M30, however it is written. */
const END_CODE = /M\+?0*(?:2|30)(?:\.0*)?(?![\d.])/;

/** The ends of a tape and the number of the program (core/gcode/parse.c): they say nothing to a controller. */
export function isMark(code: string): boolean {
  return code.startsWith("%") || PERCENT.test(code) || NUMBER.test(code);
}

/** What of a file is not run; lines are 1-based in the file, 0 = none. */
export interface Ending {
  /** The M2, M30 or % that ends the program. */
  line: number;
  /** Lines with code after it. */
  unrun: number;
  /** The first of those. */
  first: number;
  /** Where another program begins. */
  second: number;
}

export class EndReader implements Ending {
  line = 0;
  unrun = 0;
  first = 0;
  second = 0;
  /** The first % or program number after the end, before `first`. */
  private mark = 0;
  private hasCode = false;
  private isOpen = false;

  /** The next line, without blanks and comments, upper case. @returns whether it belongs to the program; its end does */
  take(code: string, number: number): boolean {
    if (this.line > 0) {
      this.takeAfter(code, number);
      return false;
    }
    if (PERCENT.test(code)) {
      this.line = this.hasCode ? number : 0;
      this.isOpen = !this.hasCode;
    } else if (code !== "" && !isMark(code)) {
      this.hasCode = true;
      if (hasEndCode(code)) this.line = number;
    }
    return true;
  }

  private takeAfter(code: string, number: number): void {
    if (PERCENT.test(code) && this.isOpen) this.isOpen = false; // it closes the program that has ended by M2 or M30
    else if (PERCENT.test(code) || NUMBER.test(code)) this.mark ||= number;
    else if (code !== "" && !isMark(code)) {
      if (this.unrun++ === 0) [this.first, this.second] = [number, this.mark];
      if (hasEndCode(code)) this.second ||= this.first;
    }
  }
}

/** An expression in place of the number is not computed. */
function hasEndCode(code: string): boolean {
  if (code.startsWith("$")) return false;
  let plain = code.replace(/<[^>]*>?/g, "");
  while (plain.includes("[")) plain = plain.replace(/\[[^\][]*\]?/g, "");
  return END_CODE.test(plain);
}

/** For people: what is not run, and how it can be; null: all of the file is run. */
export function endingWords({ line, unrun, first, second }: Ending): { title: string; text: string } | null {
  if (unrun === 0) return null;
  const begin = second || first;
  return {
    title: unrun === 1 ? t`Line ${first} is not run: the program ends in line ${line}` : t`${unrun} lines from line ${first} on are not run: the program ends in line ${line}`,
    text: second
      ? t`Another program begins in line ${second}. To run it, save the file from there on as a separate file.`
      : t`To run them, save the file from line ${begin} on as a separate file, or take out what ends the program.`,
  };
}
