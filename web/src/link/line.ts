/**
 * Lines that people type. Every byte from 0x80 on, and `!`, `?`, `~`, is a real-time command wherever it is in a
 * line: the UTF-8 of one `Ä` in a comment would open the safety door. Pure.
 */
import type { RealtimeName } from "../tables";
import { msg, t, tr } from "../words";

/** A line that must be changed before it is sent. */
export class LineError extends Error {}

const COMMENT = /\([^)]*\)|\(.*$|;.*$/g;
const NOT_PRINTABLE = /[^\x20-\x7e]/;
const REALTIME: Readonly<Record<string, { name: RealtimeName; title: string }>> = {
  "!": { name: "HOLD", title: msg`feed hold` },
  "~": { name: "RESUME", title: msg`resume` },
  "?": { name: "STATUS", title: msg`status report` },
};

/** The real-time command that this line is, alone on it; null: it is none. */
export function realtimeOf(text: string): RealtimeName | null {
  return REALTIME[text.trim()]?.name ?? null;
}

/** Of the tool table: its comment is the text of the tool. Those of pauses and tool changes (M0, M1, M6) are in messages, and so are
 * comments for the operator in any line. */
const TOOL_ROW = /^(?:N[\d.]+)?G10(?!\d).*L1(?!\d)/i;
const SHOWN = /M(?:0*[16]|0+)(?![\d.])/i;
const MESSAGE = /^.\s*(?:MSG|PRINT|DEBUG),/i;
const OPENING = /^ *(?:MSG|PRINT|DEBUG),/i;
const NOT_SHOWN = /[^\x20-\x7e]|[!?~]/g;

/** What the controller keeps or shows of a line's comments (those in brackets if there are any), in one pair of brackets: a tool's text
 * as it is written, what is only shown in ASCII. @param code  the line without comments and blanks */
export function keptComment(text: string, code: string): string {
  let said = chosenComment(text, code);
  if (!TOOL_ROW.test(code)) said = said.normalize("NFKD").replace(NOT_SHOWN, "").trim(); // wide brackets become plain ones, which must not end the comment
  said = said.replace(/\(/g, "[").replace(/\)/g, "]"); // shown as round ones
  return said && `(${said.trim() || " "})`;
}

/** The same as it is written in the file, for people, without MSG and brackets. */
export function writtenComment(text: string, code: string): string {
  return chosenComment(text, code).replace(OPENING, "").trim();
}

function chosenComment(text: string, code: string): string {
  const isRow = TOOL_ROW.test(code);
  const found: string[] = text.match(COMMENT) ?? [];
  const messages = isRow ? [] : found.filter((comment) => MESSAGE.test(comment));
  const all = isRow || messages.length > 0 || (!code.startsWith("$") && SHOWN.test(code)) ? found : [];
  const bracketed = all.filter((comment) => comment.startsWith("("));
  const kept = [messages, bracketed, all].find((each) => each.length > 0) ?? [];
  return kept.map((comment) => comment.replace(/^.|(?<=^\(.*)\)$/g, "")).join("");
}

const SHOWN_SIZE = 80; // LINE_COMMENT_SIZE of core/config.h
const ROUND: Readonly<Record<string, string>> = { "[": "(", "]": ")", "|": "/" };

/** A comment that was kept, as the controller's message has it (line_reader_comment()). */
export function shownComment(comment: string): string {
  const text = comment.slice(1, -1).slice(0, SHOWN_SIZE);
  return text.replace(OPENING, "").trim().replace(/[[\]|]/g, (mark) => ROUND[mark]!);
}

/** The line without its comments, but for those. Throws LineError when it holds what would act as a command. */
export function typedLine(text: string): string {
  const bare = text.replace(COMMENT, "").trim();
  checkLine(bare);
  const comment = keptComment(text, bare.replace(/\s/g, ""));
  if (NOT_PRINTABLE.test(comment)) throw new LineError(t`A text has letters without accents, digits and signs, but no brackets and none of | ! ? ~`);
  checkLine(comment);
  return bare + comment;
}

/** Throws LineError when a line holds anything but printable ASCII, or a real-time command. */
export function checkLine(line: string): void {
  const strange = NOT_PRINTABLE.exec(line)?.[0];
  if (strange !== undefined)
    throw new LineError(t`${name(strange)} is not ASCII, and a controller reads its bytes as commands. Use it in comments only.`);
  const command = [...line].find((character) => character in REALTIME);
  if (command !== undefined)
    throw new LineError(t`${command} is the command "${tr(REALTIME[command]!.title)}" anywhere in a line. Send it alone.`);
}

function name(character: string): string {
  return character < " " || character === "\x7f" ? t`The control character 0x${character.charCodeAt(0).toString(16)}` : `"${character}"`;
}
