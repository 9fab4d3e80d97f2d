/** Comments that stay in a line on its way to a controller: the cases of protocol/vectors/comments.json, which the command's tests pass, too. */
import { readFileSync } from "node:fs";
import { expect, it } from "vitest";
import { codeOf, numbered, ProgramError, readProgram } from "../src/job/program";
import { keptComment, LineError, typedLine } from "../src/link/line";

interface Case {
  line: string;
  comment: string;
  typed: boolean;
  job: string | null;
}

const { cases } = JSON.parse(readFileSync(new URL("../../protocol/vectors/comments.json", import.meta.url), "utf8")) as { cases: Case[] };

it.each(cases)("keeps of $line its comment", ({ line, comment, typed }) => {
  expect(keptComment(line, codeOf(line))).toBe(comment);
  if (typed) expect(typedLine(line).trimEnd().endsWith(comment)).toBe(true);
  else expect(() => typedLine(line)).toThrow(LineError);
});

it.each(cases)("sends $line of a job", ({ line, job }) => {
  if (job === null) expect(() => readProgram("job.nc", line)).toThrow(ProgramError);
  else expect(numbered(readProgram("job.nc", line).lines[0]!)).toBe(job);
});
