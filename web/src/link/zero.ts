/** The way to work zero: first Z up, then X and Y. It never moves Z down and never leaves the travel. Pure. */
import { AXES, settingNumber } from "../tables";
import { t } from "../words";

export interface ZeroFacts {
  axisCount: number;
  /** Axes whose machine position is known, as letters. */
  homed: string;
  /** Machine coordinates and work offsets, mm. */
  machine_mm: readonly number[];
  offset_mm: readonly number[];
  /** $N -> text. */
  settings: ReadonlyMap<number, string>;
}

export type ZeroPlan =
  /** `$J=` lines, one after the other, each when the machine is at rest; Z must have come to z_mm (machine) after the first. */
  | { kind: "go"; lines: string[]; z_mm: number | null }
  /** How far Z may lift is not known: a person has to say. */
  | { kind: "ask" }
  | { kind: "refuse"; why: string };

const HOMING_DIRECTIONS = settingNumber("homing_dir_mask");
const PULL_OFF = settingNumber("homing_pull_off_mm");
const MAX_RATE = settingNumber("max_rate_mm_min");
const TRAVEL = settingNumber("max_travel_mm");
const [X, Y, Z] = [0, 1, 2];
/** Off a switch by this much at least, mm. */
const CLEAR_MM = 1;
/** Of what reports round. */
const ROUNDING_MM = 0.005;

/** @param lift_mm how far a person lets Z lift from where it is; null: no one was asked */
export function planZero(facts: ZeroFacts, lift_mm: number | null): ZeroPlan {
  if (facts.machine_mm.length === 0 || facts.offset_mm.length === 0)
    return refuse(t`The controller has not reported its position and its work offset yet. Try again in a moment.`);
  const across = `$J=G21G90X0Y0F${number(rate(facts, X) + rate(facts, Y))}`;
  if (facts.axisCount <= Z) return { kind: "go", lines: [across], z_mm: null };
  if (![..."XYZ"].every((axis) => facts.homed.includes(axis))) return fromHere(facts, lift_mm, across);
  for (const axis of [X, Y]) {
    const why = outside(facts, axis, facts.offset_mm[axis]!);
    if (why) return refuse(why);
  }
  const top_mm = -clear(facts);
  const [z_mm, travel_mm] = [facts.machine_mm[Z]!, setting(facts, TRAVEL + Z)];
  if (travel_mm > 0 && travel_mm <= clear(facts)) return refuse(t`The travel of Z ($${TRAVEL + Z}) leaves no room below its switch. Set it first.`);
  if (z_mm >= top_mm - ROUNDING_MM) return { kind: "go", lines: [across], z_mm: null };
  return { kind: "go", lines: [`$J=G53G21G90Z${number(top_mm)}F${number(rate(facts, Z))}`, across], z_mm: top_mm };
}

/** Not homed: only as far up as someone has said. */
function fromHere(facts: ZeroFacts, lift_mm: number | null, across: string): ZeroPlan {
  if (lift_mm === null) return { kind: "ask" };
  if (!(lift_mm >= 0)) return refuse(t`The lift of Z must be 0 mm or more: this move never lowers Z.`);
  if (lift_mm === 0) return { kind: "go", lines: [across], z_mm: null };
  const lift = `$J=G21G91Z${number(lift_mm)}F${number(rate(facts, Z))}`;
  return { kind: "go", lines: [lift, across], z_mm: facts.machine_mm[Z]! + lift_mm };
}

/** Why a machine position of an axis cannot be reached; "": it can. */
export function outside(facts: ZeroFacts, axis: number, zero_mm: number, what = t`Work zero of ${AXES[axis]}`): string {
  const travel_mm = setting(facts, TRAVEL + axis);
  if (travel_mm <= 0) return ""; // without limits
  const homesLow = ((setting(facts, HOMING_DIRECTIONS) >> axis) & 1) !== 0;
  const low_mm = -travel_mm + (homesLow ? clear(facts) : 0);
  const high_mm = homesLow ? 0 : -clear(facts);
  if (zero_mm >= low_mm - ROUNDING_MM && zero_mm <= high_mm + ROUNDING_MM) return "";
  return t`${what} is at ${zero_mm.toFixed(3)} mm in machine coordinates, and ${AXES[axis]} moves from ${low_mm.toFixed(3)} to ${high_mm.toFixed(3)}. Nothing was moved: set it within this range.`;
}

/** How far the machine stays off its switches. */
export function clear(facts: ZeroFacts): number {
  return Math.max(setting(facts, PULL_OFF), CLEAR_MM);
}

export function rate(facts: ZeroFacts, axis: number): number {
  return setting(facts, MAX_RATE + axis) || 1;
}

function setting(facts: ZeroFacts, n: number): number {
  return Number(facts.settings.get(n) ?? 0) || 0;
}

function refuse(why: string): ZeroPlan {
  return { kind: "refuse", why };
}

function number(value: number): string {
  return String(Number(value.toFixed(3)));
}
