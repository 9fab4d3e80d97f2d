/** The controller's tool table: what `$#` says of it, and the lines that change it. In mm here. Pure. */
import { t } from "../words";
import { typedPosition } from "./offsets";

export interface Tool {
  number: number;
  length_mm: number;
  diameter_mm: number;
  text: string;
}

/** What was typed into the fields of a row. */
export interface TypedTool {
  number: string;
  length: string;
  diameter: string;
  text: string;
}

/** core/gcode/gcode.h and core/machine/tool_notes.h. */
export const TOOLS_MOST = 96;
export const TOOL_TEXT_MOST = 23;
const LENGTH_MOST_MM = 100_000;
const MM_PER_INCH = 25.4;
const Z = 2;
const ROW = /^\[T:(\d+)\|([-\d.,]+)\|([\d.]+)(?:\|([^\]]*))?\]$/;
/** What a comment and a report keep as it is. */
const TEXT = /^[ -~]*$/;
const MARKS = /[()[\]|!?~]/;

/** Of the answer to `$#`, in the unit of reports. */
export function toolsOf(said: readonly string[], inInches: boolean): Tool[] {
  const unit_mm = inInches ? MM_PER_INCH : 1;
  return said.flatMap((line) => {
    const [, number, offsets = "", radius, text = ""] = ROW.exec(line) ?? [];
    if (!number) return [];
    return [{ number: Number(number), length_mm: Number(offsets.split(",")[Z] ?? 0) * unit_mm, diameter_mm: 2 * Number(radius) * unit_mm, text }];
  });
}

/** Fields that are left blank stay as they are: a G43 with a length that no one has typed would break the tool. */
export function rowOf(typed: TypedTool, known: readonly Tool[], inInches: boolean): Tool {
  const number = Number(typed.number || NaN);
  const before = known.find((tool) => tool.number === number);
  const mm = (text: string, stays: number): number => (text.trim() === "" ? stays : (typedPosition(text, inInches) ?? NaN));
  return { number, length_mm: mm(typed.length, before?.length_mm ?? 0), diameter_mm: mm(typed.diameter, before?.diameter_mm ?? 0), text: typed.text.trim() };
}

/** Why this is no row of the table; "": it is one. */
export function toolProblem({ number, length_mm, diameter_mm, text }: Tool): string {
  if (!Number.isInteger(number) || number < 1 || number > TOOLS_MOST) return t`The number of a tool is 1 to ${TOOLS_MOST}.`;
  if (!(Math.abs(length_mm) <= LENGTH_MOST_MM)) return t`The length is not a number.`;
  if (!(diameter_mm >= 0 && diameter_mm <= LENGTH_MOST_MM)) return t`The diameter is not a number, or negative.`;
  if (!TEXT.test(text) || MARKS.test(text)) return t`A text has letters without accents, digits and signs, but no brackets and none of | ! ? ~`;
  return text.length > TOOL_TEXT_MOST ? t`A text has at most ${TOOL_TEXT_MOST} characters.` : "";
}

/** The line that stores a row. A comment of a blank clears the text. */
export function toolLine({ number, length_mm, diameter_mm, text }: Tool): string {
  return `G10L1P${number}Z${short(length_mm)}R${short(diameter_mm / 2)}(${text.trim() || " "})`;
}

/** 0.1 um: an inch that was typed with four digits comes back as it was. */
function short(mm: number): string {
  return String(Number(mm.toFixed(5)));
}
