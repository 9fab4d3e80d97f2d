/**
 * The state of the machine before a job, as lines that bring the core of the preflight into the same state: settings,
 * place, offsets and modes; and whether the job then stays within the machine's travel. Pure.
 */
import { AXES, findSetting, settingNumber } from "../tables";
import { sendingOrder } from "../link/settingsfile";
import { t } from "../words";

/** mm, and degrees of rotary axes; of a machine that reports in inches, converted. */
export interface Standing {
  /** $N -> text; empty: no machine. */
  settings: ReadonlyMap<number, string>;
  machine_mm: readonly number[];
  /** G54 to G59.3, G28, G30, G92, TLO. */
  offsets: ReadonlyMap<string, readonly number[]>;
  /** The offset of the work system in force, with G92 and tool length. */
  origin_mm: readonly number[];
  /** Words of `$G`. */
  modes: string;
  /** Letters of the axes whose machine position is known. */
  homed: string;
}

export const NOWHERE: Standing = { settings: new Map(), machine_mm: [], offsets: new Map(), origin_mm: [], modes: "", homed: "" };

const SOFT_LIMITS = settingNumber("soft_limits");
const DEVIATION = settingNumber("junction_deviation_mm");
const STEPS = settingNumber("steps_per_mm");
const TRAVEL = settingNumber("max_travel_mm");
const SYSTEMS = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"];
/** Of `$G`: what a job may leave to the controller, but for motion, tool and what is switched on. */
const MODE = /^(G5[4-9](\.[123])?|G1[789]|G2[01]|G9[01](\.1)?|G9[345]|[FS][\d.]+)$/;
/** Of what reports round. */
const ROUNDING_MM = 0.005;

/** Lines before the job. Soft limits last: until then the core moves to places that may lie outside. */
export function linesBefore(standing: Standing): string[] {
  const set = sendingOrder(standing.settings.keys()).map((number) => `$${number}=${standing.settings.get(number)}`);
  const limits = set.filter((line) => line.startsWith(`$${SOFT_LIMITS}=`));
  return [...set.filter((line) => !limits.includes(line)), ...placeLines(standing), ...limits, "G4P0"]; // at rest
}

/** Whether the job moves in another way without this line; a charge pump or a relay does not change the path. */
export function matters(line: string): boolean {
  const number = /^\$(\d+)=/.exec(line)?.[1];
  const affects = number === undefined ? ["motion"] : (findSetting(Number(number))?.row.affects ?? []);
  return ["motion", "position", "program"].some((part) => affects.includes(part));
}

function placeLines(standing: Standing): string[] {
  if (standing.machine_mm.length === 0) return [];
  const lines = ["G21G90G94G17G54"];
  for (const name of ["G28", "G30"] as const) {
    const place = standing.offsets.get(name);
    if (place?.some((value) => value !== 0)) lines.push(`G53G0${words(place)}`, `${name}.1`);
  }
  lines.push(`G53G0${words(standing.machine_mm)}`);
  SYSTEMS.forEach((name, i) => {
    const offset = standing.offsets.get(name);
    if (offset) lines.push(`G10L2P${i + 1}${words(offset)}`);
  });
  const length_mm = standing.offsets.get("TLO")?.[0] ?? 0;
  if (length_mm) lines.push(`G43.1Z${number(length_mm)}`);
  lines.push(...shiftLines(standing, length_mm));
  const modes = modeLine(standing.modes);
  if (modes) lines.push(modes);
  return lines;
}

/** What a job may leave to the controller, of `$G`, as a line; "": nothing is known. */
export function modeLine(modes: string): string {
  return modes.split(" ").filter((word) => MODE.test(word)).join("");
}

/** G92 gives the present place a name: the one that leaves the offset which the machine has. */
function shiftLines({ machine_mm, offsets }: Standing, length_mm: number): string[] {
  const shift = offsets.get("G92") ?? [];
  if (!shift.some((value) => value !== 0)) return [];
  const system = offsets.get("G54") ?? [];
  const named = machine_mm.map((mm, i) => mm - (system[i] ?? 0) - (shift[i] ?? 0) - (AXES[i] === "Z" ? length_mm : 0));
  return [`G92${words(named)}`];
}

function words(values: readonly number[]): string {
  return values.map((value, i) => `${AXES[i]}${number(value)}`).join("");
}

function number(value: number): string {
  return String(Number(value.toFixed(4)));
}

/** What the job does with the travel of one axis, in words. */
export interface TravelFinding {
  axis: string;
  text: string;
}

/** Bounds are those of steps: the path may be off by the junction deviation at a corner, outside of it as well, and a motor by a step. */
function slackOf(standing: Standing, axis: number): number {
  const number = (setting: number): number => Number(standing.settings.get(setting) ?? 0) || 0;
  const steps_per_mm = number(STEPS + axis);
  return ROUNDING_MM + number(DEVIATION) + (steps_per_mm > 0 ? 1 / steps_per_mm : 0);
}

/** Bounds in machine coordinates. An axis that was not homed has no known place: there only its way must fit. */
export function travelFindings(standing: Standing, min_mm: readonly number[], max_mm: readonly number[]): TravelFinding[] {
  const found: TravelFinding[] = [];
  [...AXES].forEach((axis, i) => {
    const travel_mm = Number(standing.settings.get(TRAVEL + i) ?? 0) || 0;
    const [low_mm, high_mm] = [min_mm[i] ?? 0, max_mm[i] ?? 0];
    const slack_mm = slackOf(standing, i);
    if (travel_mm <= 0 || high_mm - low_mm < slack_mm) return;
    const isHomed = standing.homed.includes(axis);
    if (isHomed && (low_mm < -travel_mm - slack_mm || high_mm > slack_mm))
      found.push({
        axis,
        text: t`${axis} moves from ${low_mm.toFixed(1)} to ${high_mm.toFixed(1)} mm in machine coordinates; its travel is from ${(-travel_mm).toFixed(1)} to 0.`,
      });
    else if (!isHomed && high_mm - low_mm > travel_mm + 2 * slack_mm)
      found.push({ axis, text: t`${axis} moves over ${(high_mm - low_mm).toFixed(1)} mm; its travel ($${TRAVEL + i}) is ${travel_mm.toFixed(1)} mm.` });
  });
  return found;
}

/** Axes that the job moves and whose place is not known, though they have a travel to leave. */
export function unplacedAxes(standing: Standing, min_mm: readonly number[], max_mm: readonly number[]): string {
  const moves = (i: number): boolean => (max_mm[i] ?? 0) - (min_mm[i] ?? 0) > ROUNDING_MM;
  return [...AXES].filter((axis, i) => moves(i) && Number(standing.settings.get(TRAVEL + i) ?? 0) > 0 && !standing.homed.includes(axis)).join("");
}

/** Whether a job that was checked for one would be another one for the other; the place alone changes nothing. Where work
 *  zero is comes with reports, which may be later than the answers to `$#` and `$G`. */
export function standsAlike(a: Standing, b: Standing): boolean {
  return keyOf(a) === keyOf(b);
}

function keyOf({ settings, offsets, origin_mm, modes, homed }: Standing): string {
  const chosen = modes.split(" ").filter((word) => MODE.test(word) && !/^[FS]/.test(word));
  return JSON.stringify([[...settings], [...offsets], origin_mm, chosen, [...homed].sort()]);
}
