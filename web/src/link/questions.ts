/** What the page asks a controller about itself, and which lines change the answers. Pure. */

export const QUESTIONS = ["$I", "$$", "$#", "$G"] as const;
export type Question = (typeof QUESTIONS)[number];

/** Words that store offsets or choose them; a `#` may set the parameter of one. */
const OFFSETS = /G0*(10|28|30|38|43|49|92)(?!\d)|#/;
const COMMENTS = /\([^)]*\)?|;.*/g;

export function isQuestion(line: string): line is Question {
  return (QUESTIONS as readonly string[]).includes(line);
}

/** Questions whose answer is another one, perhaps, after this line. */
export function changedBy(line: string): readonly Question[] {
  const code = line.replace(COMMENTS, "").replace(/\s+/g, "").toUpperCase();
  if (code === "") return [];
  if (code.startsWith("$RST=")) return QUESTIONS;
  if (/^\$\d+=/.test(code)) return ["$$", "$#"]; // $13: in inches from now on
  if (code === "$C") return ["$G"];
  if (code.startsWith("$")) return [];
  return OFFSETS.test(code) ? ["$G", "$#"] : ["$G"];
}
