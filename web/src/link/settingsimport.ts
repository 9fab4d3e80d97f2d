/** Settings of a file: a TOML file, the one of `wificnc settings export`, lines of `$$`, or a machine profile. Loaded with
 * the first file: nothing else needs a reader of TOML. Pure. */
import { parse } from "smol-toml";
import { AXES, settingProblem, settingsOf } from "../tables";
import { t } from "../words";
import { SCHEMA, SettingsFileError } from "./settingsfile";

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
