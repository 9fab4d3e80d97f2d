/**
 * Resume in the middle of a job, as `wificnc send --from-line` does it: the lines before N run through the core's own
 * parser twice, from two different places. What comes out the same is known; an axis that moved and comes out different
 * cannot be known, and the resume is refused rather than guessed.
 *
 * How it returns: first Z up to the highest place that the job has used, then the spindle and time for it to run up, then
 * X, Y and the turning axes, then Z down at a careful feed. The modal words of line N come last.
 */
import { AXES, errorWords } from "../tables";
import type { Core, Modes } from "./core";
import type { JobLine } from "./program";
import { modeLine } from "./standing";
import { t } from "../words";

/** What the controller says of itself before the resume; mm. */
export interface MachineFacts {
  axisCount: number;
  machine_mm: number[];
  /** Rows of `$#`: G54 .. G59, G28, G30, G92, TLO. */
  offsets: Record<string, number[]>;
  /** Words of `$G` in which the first line of the job runs; left out: those of a reset. */
  modes?: string;
  laser: boolean;
}

export interface Resume {
  line: number;
  preamble: string[];
  lines: JobLine[];
  notes: string[];
}

export class ResumeError extends Error {
  constructor(
    message: string,
    readonly hint = "",
  ) {
    super(message);
  }
}

const SPINDLE_WAIT_S = 4;
const PLUNGE_MM_MIN = 200;
const SAME_MM = 1e-6;
const CHECK_MM = 1e-4;
const Z = AXES.indexOf("Z");
/** Two places that no program ends at by chance. */
const SOMEWHERE_MM = [-311.625, 247.375, -211.875, 97.625, -57.875, 33.375];
const ELSEWHERE_MM = [137.25, -91.5, 53.125, 31.75, -17.5, 71.25];
/** Rows of `$#`, as rebuild_set_offset() counts them. */
const ROWS: Record<string, number> = {
  ...Object.fromEntries(["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"].map((row, i) => [row, i])),
  G28: -28,
  G30: -30,
  G92: -92,
  TLO: -43,
};
/** Canned cycles and splines: words of one line hold for the next. */
const ROW_MODES = new Set([50, 51, 730, 810, 820, 830, 850, 860, 890]);
const MOTION_CODES = new Set([0, 1, 2, 3, 5, 5.1, 33, 38.2, 38.3, 38.4, 38.5, 73, 76, 80, 81, 82, 83, 84, 85, 86, 87, 88, 89]);
const AXES_FOR_OTHERS = new Set([10, 28, 28.1, 30, 30.1, 43, 43.1, 92, 92.1]);

/** What to send to continue from a line of the file. Throws ResumeError. */
export function planResume(core: Core, lines: readonly JobLine[], line: number, facts: MachineFacts): Resume {
  const before = lines.filter((entry) => entry.number < line);
  const rest = lines.filter((entry) => entry.number >= line);
  if (rest.length === 0) throw new ResumeError(t`Nothing to send from line ${line}`);
  if (!facts.offsets.G54) throw new ResumeError(t`The controller has not reported its offsets`, t`Connect again while the machine is stopped.`);
  const all = [...firstModes(facts), ...before];
  const here = run(core, all, facts, SOMEWHERE_MM);
  const there = run(core, all, facts, ELSEWHERE_MM);
  const known = knownAxes(here, there, facts);
  const preamble = preambleOf(here, there, known, facts);
  check(core, here, known, preamble, facts);
  const full = [...preamble.map(asLine), ...withMotion(here, rest)];
  return { line, preamble, lines: full, notes: notesOf(here, known, facts) };
}

/** A program that names no work system runs in the one that the operator has chosen. */
function firstModes({ modes = "" }: MachineFacts): JobLine[] {
  const line = modeLine(modes);
  return line ? [asLine(line)] : [];
}

function asLine(code: string): JobLine {
  return { number: 0, text: code, code };
}

function run(core: Core, lines: readonly JobLine[], facts: MachineFacts, start: readonly number[]): Modes {
  core.rebuild(facts.axisCount, start);
  for (const [name, mm] of Object.entries(facts.offsets)) {
    const row = ROWS[name];
    if (row !== undefined) core.rebuildOffset(row, name === "TLO" ? [0, 0, mm[0] ?? 0] : mm);
  }
  for (const line of lines) {
    const code = core.rebuildLine(line.code);
    if (code) throw new ResumeError(t`Line ${line.number} (${line.text}), before the resume: ${errorWords(code)}`);
  }
  return core.modes();
}

function knownAxes(here: Modes, there: Modes, facts: MachineFacts): boolean[] {
  const g92 = facts.offsets.G92 ?? [];
  if (here.g92_mm.some((value, i) => Math.abs(value - (g92[i] ?? 0)) > SAME_MM))
    throw new ResumeError(t`The lines before set a G92 offset, which depends on the machine's position at that time`);
  if (ROW_MODES.has(here.motion_g10))
    throw new ResumeError(
      t`The lines before are in a sequence of canned cycles or splines (${gWord(here.motion_g10)})`,
      t`Resume at the first line of the sequence, or after the next G0, G1 or G80.`,
    );
  const known = here.work_mm.map((value, i) => Math.abs(value - (there.work_mm[i] ?? NaN)) < SAME_MM);
  const moved = here.moved | there.moved;
  const lost = [...AXES].filter((_, i) => i < facts.axisCount && !known[i] && (moved >> i) & 1);
  if (lost.length > 0)
    throw new ResumeError(
      t`Where ${lost.join(t` and `)} should be is unknown: it depends on the position at the start of the job`,
      t`Relative moves (G91), G28, G30 and G53 cause this; resume after a line with absolute coordinates.`,
    );
  return known;
}

/** The lines in front of line N. All in mm and absolute, until the last ones. */
function preambleOf(here: Modes, there: Modes, known: boolean[], facts: MachineFacts): string[] {
  const safe = safeZ(here, there, facts);
  const spindle = spindleOf(here, facts);
  const lines = [`G21G90G94G17${gWord(here.wcs_g10)}`];
  if (Math.abs(here.tool_length_mm - (facts.offsets.TLO?.[0] ?? 0)) > SAME_MM)
    lines.push(here.tool_length_mm ? `G43.1Z${number(here.tool_length_mm)}` : "G49");
  if (safe !== null) lines.push(`G0Z${number(safe)}`);
  if (here.tool) lines.push(`T${here.tool}`);
  if (!facts.laser) lines.push(...spindle);
  const across = [...AXES].slice(0, facts.axisCount).flatMap((axis, i) =>
    i !== Z && known[i] ? [`${axis}${number(here.work_mm[i]!)}`] : [],
  );
  if (across.length > 0) lines.push(`G0${across.join("")}`);
  if (here.coolant & 1) lines.push("M7");
  if (here.coolant & 2) lines.push("M8");
  if (safe !== null && known[Z] && here.work_mm[Z]! < safe - SAME_MM) {
    const down = number(here.work_mm[Z]!);
    lines.push(facts.laser ? `G0Z${down}` : `G1Z${down}F${PLUNGE_MM_MIN}`);
  }
  return [...lines, ...modalWords(here), ...(facts.laser ? spindle : [])];
}

/** Where to cross over the work; null when the job has not moved Z. Never below where Z is. */
function safeZ(here: Modes, there: Modes, facts: MachineFacts): number | null {
  if (facts.axisCount <= Z) return null;
  const offset = here.machine_mm[Z]! - here.work_mm[Z]!;
  const tops = [here, there].map((modes) =>
    modes.top_z_mm === null ? null : modes.top_z_mm - (modes.machine_mm[Z]! - modes.work_mm[Z]!),
  );
  const [top, other] = tops;
  if (top === null || top === undefined || other === null || other === undefined) return null;
  if (Math.abs(top - other) >= SAME_MM) throw new ResumeError(t`No safe height found in the lines before`);
  return Math.max(facts.machine_mm[Z]! - offset, top);
}

function spindleOf(modes: Modes, facts: MachineFacts): string[] {
  const speed = modes.spindle_rpm ? `S${number(modes.spindle_rpm)}` : "";
  if (modes.spindle_m === 5) return speed ? [speed] : [];
  return [`M${modes.spindle_m}${speed}`, ...(facts.laser ? [] : [`G4P${SPINDLE_WAIT_S}`])];
}

/** The modes of line N, where they differ from the preamble's. F is in mm/min, so it comes before G20. */
function modalWords(modes: Modes): string[] {
  const lines = [`F${number(Number(modes.feed_mm_min.toPrecision(6)))}`];
  let words = "";
  if (modes.plane_g !== 17) words += `G${modes.plane_g}`;
  if (modes.distance_g !== 90) words += `G${modes.distance_g}`;
  if (modes.units_g !== 21) words += `G${modes.units_g}`;
  if (modes.arc_absolute) words += "G90.1";
  if (modes.path_g10 !== 640) words += gWord(modes.path_g10);
  else if (modes.path_tolerance_mm) lines.push(`G64P${number(modes.path_tolerance_mm)}`);
  if (words) lines.push(words);
  if (motionStandsAlone(modes)) lines.push(gWord(modes.motion_g10));
  if (modes.feed_mode_g !== 94) lines.push(`G${modes.feed_mode_g}`);
  return lines;
}

/** Whether the motion word can be sent without a motion: arcs and probes cannot, and G1 needs its F. */
function motionStandsAlone(modes: Modes): boolean {
  return modes.motion_g10 === 0 || modes.motion_g10 === 800 || (modes.motion_g10 === 10 && modes.feed_mm_min > 0);
}

/** Give the first line that relies on the motion mode its word, when that could not be sent before. */
function withMotion(modes: Modes, rest: readonly JobLine[]): JobLine[] {
  const lines = [...rest];
  if (motionStandsAlone(modes)) return lines;
  for (const [i, line] of lines.entries()) {
    const words = [...line.code.matchAll(/([A-Z])([-+]?\d*\.?\d*)/g)].map((word) => [word[1]!, Number(word[2])] as const);
    const codes = words.filter(([letter]) => letter === "G").map(([, value]) => value);
    if (codes.some((code) => MOTION_CODES.has(code))) break;
    if (words.some(([letter, value]) => letter === "M" && (value === 2 || value === 30))) break;
    if (words.some(([letter]) => AXES.includes(letter)) && !codes.some((code) => AXES_FOR_OTHERS.has(code))) {
      lines[i] = { ...line, code: gWord(modes.motion_g10) + line.code };
      break;
    }
  }
  return lines;
}

const SAME_WORDS = ["path_g10", "wcs_g10", "plane_g", "units_g", "distance_g", "feed_mode_g", "spindle_m", "coolant", "tool", "arc_absolute"] as const;
const NEAR_WORDS = ["feed_mm_min", "spindle_rpm", "tool_length_mm", "path_tolerance_mm"] as const;

/** The preamble through the same parser must end where the lines before did. */
function check(core: Core, wanted: Modes, known: boolean[], preamble: readonly string[], facts: MachineFacts): void {
  const got = run(core, preamble.map(asLine), facts, facts.machine_mm);
  const wrong: string[] = SAME_WORDS.filter((name) => got[name] !== wanted[name]);
  wrong.push(...NEAR_WORDS.filter((name) => !near(got[name], wanted[name])));
  if (motionStandsAlone(wanted) && got.motion_g10 !== wanted.motion_g10) wrong.push("motion");
  wrong.push(...[...AXES].filter((_, i) => i < facts.axisCount && known[i] && !near(got.work_mm[i]!, wanted.work_mm[i]!)));
  if (wrong.length > 0) throw new ResumeError(t`The resume would not restore ${wrong.join(", ")}: please report this job`);
}

function near(got: number, wanted: number): boolean {
  return Math.abs(got - wanted) <= Math.max(CHECK_MM, 1e-6 * Math.abs(wanted));
}

function notesOf(modes: Modes, known: boolean[], facts: MachineFacts): string[] {
  const notes: string[] = [];
  if (modes.stored)
    notes.push(t`Lines before store offsets (G10, G28.1, G30.1) or use the tool table (G43): they are assumed to be stored in the controller already.`);
  const still = [...AXES].filter((_, i) => i < Math.min(3, facts.axisCount) && !known[i]);
  if (still.length > 0) notes.push(stillWords(still));
  return notes;
}

/** @param axes  that the lines before do not position; one or more */
export function stillWords(axes: readonly string[]): string {
  const last = axes.at(-1)!;
  if (axes.length === 1) return t`${last} does not move: the lines before do not position it.`;
  return t`${axes.slice(0, -1).join(", ")} and ${last} do not move: the lines before do not position them.`;
}

function gWord(timesTen: number): string {
  return `G${timesTen / 10}`;
}

/** 12.5, -0.00254, 3: at most five decimals, no trailing zeros, no exponent. */
export function number(value: number): string {
  const text = value.toFixed(5).replace(/\.?0+$/, "");
  return text === "-0" ? "0" : text;
}
