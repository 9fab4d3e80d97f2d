/**
 * What the page knows of settings, boards, storage and words. The numbers are generated from the repository's tables
 * (`make generate`); here are their shapes and look-ups.
 */
import raw from "../../build/generated/tables.json";
import { msg, t, tr } from "./words";

export interface SettingRow {
  /** $N; of X when per_axis. */
  number: number;
  name: string;
  type: "bool" | "u8" | "u16" | "float";
  unit: string;
  default: number | boolean;
  min: number;
  max: number;
  decimals: number;
  per_axis: boolean;
  reboot: boolean;
  help: string;
  /** What follows from it: the column of protocol/settings.toml. */
  affects: string[];
  /** Key in the ESP32's storage; {axis} = x..c. */
  nvs: string;
}

export interface StoredText {
  key: string;
  /** Bytes of UTF-8. */
  min: number;
  max: number;
  secret: boolean;
  help: string;
}

export interface StoredNumber {
  key: string;
  bits: 8 | 16;
  default: number;
  min: number;
  max: number;
  help: string;
}

export interface StoredPin {
  key: string;
  signal: string;
  label: string;
  output: boolean;
}

export interface Storage {
  namespace: string;
  /** Of the NVS partition, bytes. */
  offset: number;
  size: number;
  /** The pin number that means: not wired. */
  none: number;
  text: StoredText[];
  number: StoredNumber[];
  pin: StoredPin[];
}

export interface WiredPin {
  signal: string;
  label: string;
  role: string;
  colour: string;
  pin: string;
  number: number;
}

export interface ChipPin {
  name: string;
  number: number;
  /** Why no output (input) can be moved there, {0} being the pin; null: it can. */
  output: string[] | null;
  input: string[] | null;
}

export interface Board {
  id: string;
  name: string;
  summary: string;
  target: "esp32" | "pic32mz" | "host";
  chip: string;
  chip_name: string;
  memory: string;
  flash_mb: number[];
  psram_mb: number[];
  axes: string;
  ethernet: boolean;
  step_rate_hz: number;
  notes: string[];
  uses: WiredPin[];
  pins: ChipPin[];
  /** struct host_board, for the preflight. */
  host: Record<HostField, number>;
}

export type HostField =
  | "timer_hz"
  | "step_pulse_ns"
  | "default_pulse_us"
  | "dir_setup_ns"
  | "max_step_rate_hz"
  | "axes"
  | "ganged"
  | "missing_outputs"
  | "digital_inputs"
  | "digital_outputs"
  | "encoder"
  | "analog"
  | "home_axes"
  | "toolsetter"
  | "spindle_bus";

export type RealtimeName = keyof typeof raw.realtime;

/** How a path is drawn: cli/wificnc/simulator/look.py. */
export interface Look {
  speed: { light: string[]; dark: string[]; levels: number };
  rapid: { light: string; dark: string; width: number; dashes: number[] };
  extent: { light: string; dark: string; width: number };
  /** Of a laser: energy by length. More than `dense` pieces have lines of these least and greatest widths, px. */
  engraving: { light: string[]; dark: string[]; quantile: number; black: number; dense: number; cover: number; widths: number[] };
  start: string;
  end: string;
  /** [log10 of the segments, width]: from, to. */
  cut_widths: number[][];
  plunge_steepness: number;
  sample_ms: number;
  accuracy_parts: number;
  /** Radians, as View's. */
  isometric: { turn: number; tilt: number };
}

interface Tables {
  version: string;
  axes: string;
  settings: SettingRow[];
  errors: Record<string, string>;
  alarms: Record<string, string>;
  realtime: Record<RealtimeName, number>;
  storage: Storage;
  look: Look;
}

export const TABLES = raw as Tables;
export const AXES = TABLES.axes;

/** One setting of one axis, or of the whole machine. */
export interface Setting {
  number: number;
  /** X .. C, or "" for a setting of the machine. */
  axis: string;
  row: SettingRow;
}

/** Every $N of a machine with so many axes, in ascending order. */
export function settingsOf(axisCount: number): Setting[] {
  return TABLES.settings.flatMap((row) =>
    row.per_axis
      ? [...AXES.slice(0, axisCount)].map((axis, i) => ({ number: row.number + i, axis, row }))
      : [{ number: row.number, axis: "", row }],
  );
}

export function findSetting(number: number): Setting | undefined {
  return settingsOf(AXES.length).find((setting) => setting.number === number);
}

/** $N of a setting by its name in the table; of X where it is per axis. */
export function settingNumber(name: string): number {
  const row = TABLES.settings.find((setting) => setting.name === name);
  if (row === undefined) throw new Error(`The table of settings has no ${name}.`);
  return row.number;
}

/** For people: words without the unit, which has a column of its own. */
export function settingName(row: SettingRow): string {
  return tr(row.name.replace(/_(mm|us|ms|rpm|pct|s2|s3|s|min)(?=_|$)/g, "").replaceAll("_", " "));
}

/** As `$$` prints it. */
export function settingText(row: SettingRow, value: number | boolean): string {
  return row.type === "float" ? Number(value).toFixed(row.decimals) : String(Number(value));
}

/** What is wrong with a value that was typed for a setting; "" when nothing is. */
export function settingProblem(row: SettingRow, text: string): string {
  const value = Number(text);
  if (text.trim() === "" || !Number.isFinite(value)) return t`a number is needed`;
  if (value < row.min || value > row.max) return t`from ${row.min} to ${row.max}`;
  if (row.type !== "float" && !Number.isInteger(value)) return t`a whole number is needed`;
  return "";
}

export function errorWords(code: number): string {
  return tr(TABLES.errors[String(code)] ?? msg`unknown error`);
}

export function alarmWords(code: number): string {
  return tr(TABLES.alarms[String(code)] ?? msg`unknown alarm`);
}

/** Why no output (input) can be moved to this pin of the board, and whose it is; null: it can. */
export function pinRefusal(board: Board, pin: ChipPin, output: boolean): string | null {
  const reasons = output ? pin.output : pin.input;
  if (reasons === null) return null;
  const owner = board.uses.find((use) => use.number === pin.number);
  const whose = owner ? [t`${pin.name} is the board's ${tr(owner.label)}`] : [];
  return [...whose, ...reasons.map((reason) => tr(reason, pin.name))].join("; ");
}
