/** What the controller says of motor drivers with registers ($DRIVERS) and of spindle drives ($SPINDLES). Pure. */
import { AXES, settingNumber } from "../tables";
import { t } from "../words";

export interface Driver {
  /** X .. C, or Y2: the second motor's. */
  name: string;
  chip: string;
  /** Address or place on its bus. */
  place: number;
  /** verified: it has proved that it has its registers; unwritten: they are left alone; written: they are about to be. */
  state: "verified" | "unwritten" | "written" | "fault";
  /** The controller's words. */
  problems: string[];
  current_ma: number;
  /** That its sense resistor allows. */
  most_ma: number;
  hold_pct: number;
  microsteps: number;
  /** Current in use, 0 .. 31. */
  scale: number;
  /** StallGuard's result: small is a heavy load. */
  load: number;
  resets: number;
}

export interface Spindle {
  /** Of $395. */
  number: number;
  chosen: boolean;
  /** On RS-485, not an output of the board. */
  drive: boolean;
  name: string;
}

const DRIVER = /^\[DRIVER:([XYZABC]2?)\|(\w+)\|(\d+)\|([a-z ,]+)\|(\d+)\|(\d+)\|(\d+)\|(\d+)\|(\d+)\|(\d+)\|(\d+)\]$/;
const SPINDLE = /^\[SPINDLE:(\d+)\|(?:-|\d+)\|(\d)\|(\*?)\w*\|([^|\]]+)\]$/;
const DRIVE = 2; // type of a spindle
const STATES: Readonly<Record<string, Exclude<Driver["state"], "fault">>> = { ok: "verified", "left alone": "unwritten", wait: "written" };
const SECOND_MOTOR = settingNumber("second_motor");

/** What $DRIVERS answers. */
export function driversOf(said: readonly string[]): Driver[] {
  return said.flatMap((line) => {
    const [, name = "", chip = "", place, words = "", ...rest] = DRIVER.exec(line) ?? [];
    if (name === "") return [];
    const state = STATES[words] ?? "fault";
    const [current_ma, most_ma, hold_pct, microsteps, scale, load, resets] = rest.map(Number) as [number, number, number, number, number, number, number];
    const problems = state === "fault" ? words.split(",") : [];
    return [{ name, chip, place: Number(place), state, problems, current_ma, most_ma, hold_pct, microsteps, scale, load, resets }];
  });
}

/** What $SPINDLES answers. */
export function spindlesOf(said: readonly string[]): Spindle[] {
  return said.flatMap((line) => {
    const [, number, type, chosen, name] = SPINDLE.exec(line) ?? [];
    return name === undefined ? [] : [{ number: Number(number), chosen: chosen === "*", drive: Number(type) === DRIVE, name }];
  });
}

/** The axis whose settings a driver has: its own, or that which it is the second motor of. */
export function settingsAxis(name: string, settings: ReadonlyMap<number, string>): number {
  const own = AXES.indexOf(name.charAt(0));
  const other = [...AXES].findIndex((_, axis) => Number(settings.get(SECOND_MOTOR + axis) ?? 0) === own + 1);
  return other < 0 || name.length > 1 ? own : other;
}

/** What the controller would refuse; "": nothing. */
export function currentProblem(text: string, most_ma: number): string {
  return Number(text) > most_ma ? t`The sense resistor of this driver allows at most ${most_ma} mA: the controller refuses more.` : "";
}

/** Steps/mm that go with other microsteps: a mm stays a mm. */
export function scaledSteps(steps: string, before: number, after: number): string {
  return ((Number(steps) * after) / before).toFixed(3);
}
