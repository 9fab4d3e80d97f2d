/** Machine profiles (examples/machines): the settings that `wificnc settings import` makes of one. The keys, and the
 * profiles that come with WiFiCNC, are generated from the model of the command line. Pure. */
import { parse } from "smol-toml";
import raw from "../../../build/generated/machines.json";
import { AXES, settingNumber, settingProblem, TABLES } from "../tables";
import { SettingsFileError } from "./settingsfile";
import { t } from "../words";

type Table = Readonly<Record<string, unknown>>;
type Model = { keys: Record<string, string>; needed: string[] };

const MODELS = raw.keys as unknown as Record<string, Model>;
const SCHEMA = 1;
const LINEAR = 3;
/** What Grbl's number reader keeps. */
const DIGITS = 8;

/** Profiles that come with WiFiCNC; $N -> text. */
export const MACHINES = raw.machines.map(({ id, name, values }) => ({
  id,
  name,
  values: new Map(Object.entries(values as unknown as Record<string, string>).map(([number, text]) => [Number(number), text])),
}));

/** $N -> text of every setting that the profile gives. Throws SettingsFileError with every fault. */
export function readProfile(text: string): Map<number, string> {
  const reader = new Reader();
  const values = reader.read(parse(text) as Table);
  if (reader.faults.length > 0) throw new SettingsFileError(reader.faults.join("; "));
  return values;
}

class Reader {
  readonly faults: string[] = [];
  private readonly values = new Map<number, string>();
  private axes: { letter: string; index: number; table: Table }[] = [];

  read(data: Table): Map<number, string> {
    if (data.schema !== SCHEMA) this.faults.push(t`schema must be ${SCHEMA}`);
    const axes = tableOf(data.axis);
    for (const key of Object.keys(axes)) if (key.length !== 1 || !AXES.toLowerCase().includes(key)) this.faults.push(t`unknown axis ${key}`);
    this.axes = [...AXES.toLowerCase()].map((letter, index) => ({ letter, index, table: tableOf(axes[letter]) })).filter(({ letter }) => letter in axes);
    if (this.axes.length === 0) this.faults.push(t`a machine has at least one axis: add a table [axis.x]`);
    for (const [name, table] of Object.entries(data)) {
      if (["schema", "name", "axis"].includes(name)) continue;
      if (name in MODELS && !["linear", "rotary", "second"].includes(name)) this.take(tableOf(table), MODELS[name]!, name, 0);
      else this.faults.push(t`unknown table ${name}`);
    }
    this.takeKinematics(tableOf(data.kinematics).type);
    for (const axis of this.axes) this.takeAxis(axis.letter, axis.index, axis.table);
    this.set("machine_axes", 1 + Math.max(...this.axes.map(({ index }) => index), 0));
    this.takeMasks();
    this.takeSecondMotors();
    if ("homing" in data) this.takeCycles(tableOf(data.homing).order);
    this.checkLimits(tableOf(data.limits), tableOf(data.homing));
    return this.values;
  }

  private set(name: string, value: unknown, offset = 0, where = name): void {
    const number = settingNumber(name) + offset;
    const row = TABLES.settings.find((entry) => entry.name === name)!;
    const isRight = row.type === "bool" ? typeof value === "boolean" : typeof value === "number";
    const problem = isRight ? settingProblem(row, String(Number(value))) : row.type === "bool" ? t`must be true or false` : t`must be a number`;
    if (problem) this.faults.push(`${where} = ${String(value)}: ${problem}`);
    else this.values.set(number, row.type === "float" ? decimal(Number(value)) : String(Number(value)));
  }

  private take(table: Table, model: Model, title: string, offset: number): void {
    for (const [key, value] of Object.entries(table)) {
      const setting = model.keys[key];
      if (setting === undefined) this.faults.push(t`unknown key ${title}.${key}`);
      else if (setting !== "") this.set(setting, value, offset, `${title}.${key}`);
    }
    for (const key of model.needed) if (!(key in table)) this.faults.push(t`${title}.${key} is missing`);
  }

  private takeKinematics(type: unknown): void {
    if (type === undefined) return;
    const kind = raw.kinematics.indexOf(String(type));
    if (kind < 0) this.faults.push(t`kinematics.type must be one of ${raw.kinematics.join(", ")}`);
    else this.set("kinematics", kind);
  }

  private takeAxis(letter: string, index: number, table: Table): void {
    const isLinear = index < LINEAR;
    this.take(isLinear ? table : { travel_deg: 0, ...table }, MODELS[isLinear ? "linear" : "rotary"]!, `axis.${letter}`, index);
    if (table.second !== undefined) this.take(tableOf(table.second), MODELS.second!, `axis.${letter}.second`, index);
    if (table.home_at !== undefined && table.home_at !== "min" && table.home_at !== "max") this.faults.push(t`axis.${letter}.home_at must be "min" or "max"`);
  }

  /** A bit for each axis; a profile that says it for no axis leaves the setting alone. */
  private takeMasks(): void {
    const home = (table: Table): unknown => (table.home_at === undefined ? undefined : table.home_at === "min");
    const own = (table: Table): unknown => {
      const { own_switch } = tableOf(table.second);
      return typeof own_switch === "boolean" ? !own_switch : own_switch;
    };
    const masks: [string, string, (table: Table) => unknown][] = [
      ["dir_invert_mask", "invert_direction", (table) => table.invert_direction],
      ["step_invert_mask", "invert_step", (table) => table.invert_step],
      ["homing_dir_mask", "home_at", home],
      ["second_dir_invert_mask", "second.invert_direction", (table) => tableOf(table.second).invert_direction],
      ["one_switch_mask", "second.own_switch", own],
    ];
    for (const [name, key, bitOf] of masks) {
      let mask: number | null = null;
      for (const { letter, index, table } of this.axes) {
        const bit = bitOf(table);
        if (bit === undefined) continue;
        if (typeof bit !== "boolean") this.faults.push(t`axis.${letter}.${key} must be true or false`);
        mask = (mask ?? 0) | (bit === true ? 1 << index : 0);
      }
      if (mask !== null) this.set(name, mask);
    }
  }

  private takeSecondMotors(): void {
    const drivers = this.axes.map(({ letter, index, table }) => ({ letter, index, driver: tableOf(table.second).driver }));
    if (drivers.every(({ driver }) => driver === undefined)) return;
    const count = 1 + Math.max(...this.axes.map(({ index }) => index));
    const taken = new Set<number>();
    for (const { letter, index, driver } of drivers) {
      const at = driver === undefined ? -1 : AXES.toLowerCase().indexOf(String(driver));
      if (driver !== undefined && (at < count || taken.has(at)))
        this.faults.push(t`axis.${letter}.second.driver must be a letter after the machine's last axis, and of no other second motor`);
      taken.add(at);
      this.set("second_motor", at + 1, index);
    }
  }

  private takeCycles(order: unknown): void {
    const letters = this.axes.map(({ letter }) => letter.toUpperCase());
    const given = order === undefined ? null : Array.isArray(order) ? order.map(String) : [String(order)];
    const usual = this.axes.filter(({ index, table }) => index < LINEAR || table.home_at !== undefined).map(({ letter }) => letter.toUpperCase());
    const homed = given ? letters : usual;
    const wrong = given?.join("").split("").find((letter, i, all) => !letters.includes(letter) || all.indexOf(letter) !== i);
    if (wrong !== undefined || (given?.length ?? 0) > raw.homing_order.length) this.faults.push(t`homing.order must name axes of this machine, each of them once`);
    raw.homing_order.forEach((cycle, i) => {
      const now = [...(given ? (given[i] ?? "") : cycle)].filter((letter) => homed.includes(letter));
      this.set(`homing_cycle_${i + 1}_mask`, now.reduce((mask, letter) => mask | (1 << AXES.indexOf(letter)), 0));
    });
  }

  private checkLimits(limits: Table, homing: Table): void {
    if (limits.soft !== true) return;
    if (homing.enabled !== true) this.faults.push(t`limits.soft needs homing.enabled = true: without homing the controller does not know where the machine is`);
    for (const { letter, index, table } of this.axes)
      if (index < LINEAR && !table.travel_mm) this.faults.push(t`limits.soft needs axis.${letter}.travel_mm`);
  }
}

function tableOf(value: unknown): Table {
  return typeof value === "object" && value !== null && !Array.isArray(value) ? (value as Table) : {};
}

/** As the controller reads it: three decimals, more when they are needed, never an exponent. */
function decimal(value: number): string {
  const usual = value.toFixed(3);
  if (Number(usual) === value) return usual;
  const more = Math.max(DIGITS - String(Math.trunc(value)).length, 3);
  const text = value.toFixed(more);
  return Math.abs(Number(text) - value) <= 1e-6 * Math.abs(value) ? text : value.toFixed(more + 3);
}
