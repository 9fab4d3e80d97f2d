/**
 * Where a program ends in its file: at M2 or M30, or at the % that closes it (RS274/NGC 3.6.1). The rule of
 * targets/sim/program_end.h; protocol/vectors/program_end.json binds them. Pure.
 */
import { t } from "../words";

const PERCENT = /^(?:N\d+)?%$/;
const NUMBER = /^(?:N\d+)?[O:]\d+$/;
/** M2 or M30, however it is written. */
const END_CODE = /M\+?0*(?:2|30)(?:\.0*)?(?![\d.])/;
/** It could end a program, and does nothing else. */
const END_ALONE = new RegExp(String.raw`^/*(?:N[\d.]*)?/*(?:${END_CODE.source})*$`);

/** A bracket that has no other in it; numbers with + - * / between them. */
const BRACKET = /\[([^\][]*)\]/;
const TERM = String.raw`[-+]*(?:\d+\.?\d*|\.\d+)`;
const SUM = new RegExp(`^(${TERM})((?:[-+*/]${TERM})*)$`);
const NEXT_TERM = new RegExp(`([-+*/])(${TERM})`, "g");

/** The ends of a tape and the number of the program (core/gcode/parse.c): they say nothing to a controller. */
export function isMark(code: string): boolean {
  return code.startsWith("%") || PERCENT.test(code) || NUMBER.test(code);
}

/** What of a file is not run; lines are 1-based in the file, 0 = none. */
export interface Ending {
  /** The M2, M30 or % that ends the program. */
  line: number;
  /** Lines with code after it, from `first` on. */
  unrun: number;
  /** The first line after it that is more than an M2 or M30. */
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
    else if (this.unrun === 0 && code !== "" && END_ALONE.test(code)) this.mark = 0; // the program that began there has no code
    else if (code !== "" && !isMark(code)) {
      if (this.unrun++ === 0) [this.first, this.second] = [number, this.mark];
      if (hasEndCode(code)) this.second ||= this.first;
    }
  }
}

/** Also as M[1+1]; what parameters and functions make is not known by reading. */
function hasEndCode(code: string): boolean {
  if (code.startsWith("$")) return false;
  let plain = code.replace(/<[^>]*>?/g, "");
  for (const found of plain.matchAll(/M\+?(?=\[)/g)) {
    const value = valueOf(plain.slice(found.index + found[0].length));
    if (value === 2 || value === 30) return true;
  }
  while (plain.includes("[")) plain = plain.replace(/\[[^\][]*\]?/g, "");
  return END_CODE.test(plain);
}

/** Of the bracket that the text begins with; null: more than a sum of products. */
function valueOf(text: string): number | null {
  for (let found; (found = BRACKET.exec(text)); ) {
    const value = sumOf(found[1]!);
    if (value === null || found.index === 0) return value;
    text = text.slice(0, found.index) + value.toFixed(15) + text.slice(found.index + found[0].length);
  }
  return null;
}

function sumOf(text: string): number | null {
  const found = SUM.exec(text);
  if (!found) return null;
  const terms = [numberOf(found[1]!)];
  for (const [, operator, term] of found[2]!.matchAll(NEXT_TERM)) {
    const value = numberOf(term!);
    if (operator === "+") terms.push(value);
    else if (operator === "-") terms.push(-value);
    else terms.push(terms.pop()! * (operator === "*" ? value : 1 / value));
  }
  const sum = terms.reduce((one, other) => one + other);
  return Number.isFinite(sum) ? sum : null;
}

/** With any signs before it. */
function numberOf(text: string): number {
  const digits = text.replace(/^[-+]+/, "");
  return (text.slice(0, text.length - digits.length).split("-").length % 2 === 1 ? 1 : -1) * Number(digits);
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
