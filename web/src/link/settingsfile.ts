/** Settings as a file, the one of `wificnc settings export`, and in which order to send them. Pure. */
import { AXES, settingNumber, settingsOf, type Setting, type SettingRow } from "../tables";

export const SCHEMA = 1;
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

