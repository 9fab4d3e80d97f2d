/**
 * A G-code file -> the lines that go to the controller. Comments and blanks stay here, but for the comments that the controller
 * keeps or shows: a `!`, `?`, `~` or a byte of an `ü` in one would be a command. Line numbers are those of the file.
 */
import { keptComment } from "../link/line";
import { t } from "../words";
import { EndReader, isMark, type Ending } from "./ending";

export interface JobLine {
  /** 1-based in the file. */
  number: number;
  /** As written in the file, for people. */
  text: string;
  /** Without comments and blanks, upper case; no line end. */
  code: string;
  /** What the controller keeps or shows of its comments, in brackets. */
  comment?: string;
}

export interface Program {
  name: string;
  source: string;
  lines: JobLine[];
  fileLines: number;
  /** What of the file is not run. */
  ending: Ending;
}

/** A file cannot be sent: what is wrong with it, and in which lines. */
export class ProgramError extends Error {}

const FAULTS_SHOWN = 5;
/** Characters of a line that our controllers take (LINE_SIZE of core/config.h without its end), and that every one does. */
const LONGEST_LINE = 256;
const LONGEST_CODE = 79;
/** A receive buffer from which on a controller is taken for one of ours, bytes (cli/wificnc/job/program.py). */
const LARGE_RX_BYTES = 1000;

/** Characters of a line that a controller with this receive buffer takes. */
export function longestLine(rx_bytes: number): number {
  return rx_bytes >= LARGE_RX_BYTES ? LONGEST_LINE : LONGEST_CODE;
}
/** A line with an O word: a stream cannot jump. */
const O_LINE = /^(?:N\d+)?O/;
const FORBIDDEN = /[^\x21-\x7e]|[!?~]/;

/** The line without blanks and comments, upper case. */
export function codeOf(line: string): string {
  return line
    .replace(/\([^)]*\)|\(.*$|;.*$/g, "")
    .replace(/[ \t\v\f]+/g, "")
    .toUpperCase();
}

const OWN_NUMBER = /^N[0-9.]+|(?<=[0-9.])N[0-9.]+/g;
/** N words above this are an error of the controller's. */
const LAST_NUMBER = 10_000_000;

/** The line as it is sent: with its number in the file as its N word, so that reports name it (`Ln:`) while it is moved. A `$` line and
 * one that is not of the file go as they are; one that would become too long goes without, or without what is only shown.
 * @param longest  characters that the controller takes */
export function numbered({ number, code, comment = "" }: JobLine, longest = LONGEST_LINE): string {
  if (code.startsWith("$") || number === 0) return code;
  const bare = code.replace(OWN_NUMBER, "");
  const name = number > LAST_NUMBER ? "" : `N${number}`;
  return [name + bare + comment, bare + comment, name + bare].find((each) => each.length <= longest) ?? bare;
}

/** LF, CR and CR LF end a line, and nothing else does. */
export function splitLines(text: string): string[] {
  const lines = text.replace(/^\ufeff/, "").split(/\r\n|\r|\n/);
  if (/^\x1a*$/.test(lines[lines.length - 1] ?? "")) lines.pop();
  return lines;
}

/** The lines of a job, up to its end. Throws ProgramError. */
export function readProgram(name: string, source: string): Program {
  const all = splitLines(source);
  const faults: string[] = [];
  const lines: JobLine[] = [];
  const ending = new EndReader();
  all.forEach((text, i) => {
    const code = codeOf(text);
    const runs = ending.take(code, i + 1);
    if (!runs || isMark(code)) return;
    const comment = keptComment(text, code);
    if (code === "" && comment === "") return;
    if (code.includes(")")) faults.push(t`line ${i + 1}: a comment ends at its first ): take out the bracket within it`);
    else if (O_LINE.test(code)) faults.push(t`line ${i + 1}: O words cannot run in a stream: convert the file with wificnc expand`);
    else if (FORBIDDEN.test(code + comment.replace(/ /g, ""))) faults.push(t`line ${i + 1}: characters that a controller reads as commands`);
    else if ((code.includes("G10") ? code + comment : code).length > LONGEST_LINE) faults.push(t`line ${i + 1}: more than ${LONGEST_LINE} characters of code`);
    lines.push({ number: i + 1, text: text.trim(), code, ...(comment && { comment }) });
  });
  if (faults.length > 0) {
    const more = faults.length > FAULTS_SHOWN ? t`; and ${faults.length - FAULTS_SHOWN} more` : "";
    throw new ProgramError(t`${name} cannot be sent: ${faults.slice(0, FAULTS_SHOWN).join("; ")}${more}`);
  }
  if (!lines.some(({ code }) => code !== "")) throw new ProgramError(t`${name} has no G-code`);
  return { name, source, lines, fileLines: all.length, ending };
}
