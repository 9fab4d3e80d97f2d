/** Settings as a file: a TOML file, the one of `wificnc settings export` and `import`, lines of `$$`, or a machine
 * profile. Pure. */
import { parse } from "smol-toml";
import { AXES, settingNumber, settingProblem, settingsOf, type Setting, type SettingRow } from "../tables";
import { t } from "../words";

const SCHEMA = 1;
/** Soft limits need homing enabled, so that goes first. */
const FIRST_OF_ALL = settingNumber("homing");
/** Points of the laser's curve, each above the one before: those that rise begin at the top. */
const CURVE = new Set(settingsOf(1).filter(({ row }) => row.name.startsWith("laser_curve_")).map(({ number }) => number));
/** Two axes never have the same driver, so it is given up first. */
const SECOND_MOTOR = settingNumber("second_motor");

export class SettingsFileError extends Error {}

/** Whether two texts are one value: 5000 and 5000.000 are. */
export function same(row: SettingRow, a: string, b: string): boolean {
  return Math.abs(Number(a) - Number(b)) < 0.5 * 10 ** -row.decimals;
}

/** The file, with units and what each one does. */
export function exportText(values: ReadonlyMap<number, string>, source: string): string {
  const known = settingsOf(AXES.length).filter((setting) => values.has(setting.number));
  const lines = [`# Settings of ${source}.`, "", `schema = ${SCHEMA}`, "", "[settings]"];
  lines.push(...rows(known.filter((setting) => setting.axis === ""), values));
  for (const axis of AXES) {
    const own = known.filter((setting) => setting.axis === axis);
    if (own.length > 0) lines.push("", `[axis.${axis.toLowerCase()}]`, ...rows(own, values));
  }
  const numbers = new Set(known.map((setting) => setting.number));
  const other = [...values].filter(([number]) => !numbers.has(number));
  if (other.length > 0) lines.push("", "[other] # of this firmware only", ...other.map(([number, value]) => `"$${number}" = "${value}"`));
  return `${lines.join("\n")}\n`;
}

function rows(settings: readonly Setting[], values: ReadonlyMap<number, string>): string[] {
  return settings.map(({ number, row }) => {
    const unit = row.unit ? ` ${row.unit}` : "";
    return `${row.name} = ${tomlValue(row, values.get(number)!)}  # $${number}${unit}: ${row.help}`;
  });
}

function tomlValue(row: SettingRow, text: string): string {
  const value = Number(text);
  if (row.type === "bool") return String(value !== 0);
  return row.type === "float" && Number.isInteger(value) ? value.toFixed(1) : String(value);
}

/** A line of `$$`, as every Grbl sender saves it, with or without its description. */
const DOLLAR = /^\$(\d{1,5})\s*=\s*(-?[\d.]+)\s*([(;].*)?$/;

/** Comments, and what else a terminal has saved: banner, alarm, messages, reports, what was typed. */
const SAID = /^([;(#<>[]|Grbl\w* |ALARM:)/;

/** As importText(), of a machine profile, too: that has a name. */
export async function readSettings(text: string): Promise<Map<number, string>> {
  return isProfile(text) ? (await import("./profile")).readProfile(text) : importText(text);
}

function isProfile(text: string): boolean {
  try {
    return parse(text).name !== undefined;
  } catch {
    return false; // importText() says why
  }
}

/** $N -> text; what the file leaves out is left alone. Throws SettingsFileError with every fault. */
export function importText(text: string): Map<number, string> {
  return /^\s*\$\d+\s*=/m.test(text) ? importDollars(text) : importToml(text);
}

function importDollars(text: string): Map<number, string> {
  const values = new Map<number, string>();
  const faults: string[] = [];
  text.split(/\r?\n/).forEach((raw, i) => {
    const line = raw.trim();
    if (line === "" || line === "ok" || line === "$$" || SAID.test(line)) return;
    const [, number, value] = DOLLAR.exec(line) ?? [];
    const row = settingsOf(AXES.length).find((setting) => setting.number === Number(number))?.row;
    const problem = row && value !== undefined ? settingProblem(row, value) : "";
    if (number === undefined || value === undefined) faults.push(t`line ${i + 1}: "${line}" is not like $110=5000`);
    else if (problem) faults.push(`$${number}=${value}: ${problem}`);
    else values.set(Number(number), value);
  });
  if (faults.length > 0) throw new SettingsFileError(faults.join("; "));
  return values;
}

function importToml(text: string): Map<number, string> {
  let data: Record<string, unknown>;
  try {
    data = parse(text);
  } catch (error) {
    throw new SettingsFileError(t`not a TOML file: ${error instanceof Error ? error.message : error}`);
  }
  if (data.schema !== SCHEMA) throw new SettingsFileError(t`schema must be ${SCHEMA}`);
  const values = new Map<number, string>();
  const faults: string[] = [];
  takeTable(data.settings, "", values, faults);
  for (const [axis, table] of Object.entries((data.axis ?? {}) as Record<string, unknown>))
    takeTable(table, axis.toUpperCase(), values, faults);
  for (const [key, value] of Object.entries((data.other ?? {}) as Record<string, unknown>)) {
    if (/^\$\d{1,5}$/.test(key)) values.set(Number(key.slice(1)), String(value));
    else faults.push(t`${key} must be like "$37"`);
  }
  if (faults.length > 0) throw new SettingsFileError(faults.join("; "));
  return values;
}

function takeTable(table: unknown, axis: string, values: Map<number, string>, faults: string[]): void {
  const known = settingsOf(AXES.length).filter((setting) => setting.axis === axis);
  for (const [name, value] of Object.entries((table ?? {}) as Record<string, unknown>)) {
    const setting = known.find((entry) => entry.row.name === name);
    const title = axis ? `${name}.${axis.toLowerCase()}` : name;
    if (!setting) faults.push(t`unknown setting ${title}`);
    else if (typeof value !== "number" && typeof value !== "boolean") faults.push(t`${title} must be a number`);
    else {
      const problem = settingProblem(setting.row, String(Number(value)));
      if (problem) faults.push(`${title} = ${value}: ${problem}`);
      else values.set(setting.number, Number(value).toFixed(setting.row.type === "float" ? setting.row.decimals : 0));
    }
  }
}

/** What to send, in an order that the controller takes. @param before, after  $N -> text, where they are known */
export function sendingOrder(numbers: Iterable<number>, before?: ReadonlyMap<number, string>, after?: ReadonlyMap<number, string>): number[] {
  const rises = (n: number): boolean => CURVE.has(n) && Number(after?.get(n) ?? 0) > Number(before?.get(n) ?? 0);
  const givesUp = (n: number): boolean => n >= SECOND_MOTOR && n < SECOND_MOTOR + AXES.length && after?.get(n) === "0";
  const rank = (n: number): number => (n === FIRST_OF_ALL ? 0 : rises(n) || givesUp(n) ? 1 : 2);
  return [...numbers].sort((a, b) => rank(a) - rank(b) || (rises(a) && rises(b) ? b - a : a - b));
}

/** Every setting's default, as `$$` prints it. */
export function defaultsText(row: SettingRow): string {
  return row.type === "float" ? Number(row.default).toFixed(row.decimals) : String(Number(row.default));
}

