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

/** Of the tool table: its comment is the text of the tool. */
const TOOL_ROW = /^G10(?!\d).*L1(?!\d)/i;
const AFTER_LINE = /;.*$/;

/** The line without its comments, but for the text of a tool. Throws LineError when the rest holds what would act as a command. */
export function typedLine(text: string): string {
  const bare = text.replace(COMMENT, "").trim();
  checkLine(bare);
  if (!TOOL_ROW.test(bare.replace(/\s/g, ""))) return bare;
  const line = text.replace(AFTER_LINE, "").trim();
  if (NOT_PRINTABLE.test(line)) throw new LineError(t`A text has letters without accents, digits and signs, but no brackets and none of | ! ? ~`);
  checkLine(line);
  return line;
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
