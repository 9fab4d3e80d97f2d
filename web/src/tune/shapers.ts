/**
 * Frequency and damping from measured waves, the input shapers for them, and what they leave. Pure.
 * Formulas, symbols and sources: cli/wificnc/tune/shapers.py, which has the same.
 */
import { settingNumber, settingsOf, settingText, AXES, type SettingRow } from "../tables";
import { t } from "../words";

/** What EI and two-hump EI tolerate at their frequency. */
const TOLERATED = 0.05;
/** Of the vibration may be left within the spread of the frequency, and that spread. */
const GOOD = 0.12;
export const SPREAD = 0.1;
const MM_S_PER_MM_MIN = 1 / 60;

export interface Mode {
  /** Without damping. */
  hz: number;
  damping: number;
}

export interface Impulses {
  weights: number[];
  times_s: number[];
}

export interface Shaper {
  /** Of the setting. */
  value: number;
  name: string;
  /** Weights before they are normalised, from what half a period leaves; times in damped periods. */
  weights: (k: number) => number[];
  periods: number[];
}

export const SHAPERS: readonly Shaper[] = [
  { value: 1, name: "ZV", weights: (k) => [1, k], periods: [0, 0.5] },
  { value: 2, name: "MZV", weights: mzv, periods: [0, 0.375, 0.75] },
  { value: 3, name: "EI", weights: (k) => [(1 + TOLERATED) / 4, ((1 - TOLERATED) / 2) * k, ((1 + TOLERATED) / 4) * k * k], periods: [0, 0.5, 1] },
  { value: 4, name: "2-hump EI", weights: twoHumpEi, periods: [0, 0.5, 1, 1.5] },
];

function mzv(k: number): number[] {
  const part = k ** 0.75;
  const outer = 1 - Math.SQRT1_2;
  return [outer, (Math.SQRT2 - 1) * part, outer * part * part];
}

function twoHumpEi(k: number): number[] {
  const v2 = TOLERATED ** 2;
  const x = Math.cbrt(v2 * (Math.sqrt(1 - v2) + 1));
  const outer = (3 * x * x + 2 * x + 3 * v2) / (16 * x);
  return [outer, (0.5 - outer) * k, (0.5 - outer) * k * k, outer * k ** 3];
}

export function impulses(shaper: Shaper, mode: Mode): Impulses {
  const root = Math.sqrt(1 - mode.damping ** 2);
  const raw = shaper.weights(Math.exp((-mode.damping * Math.PI) / root));
  const total = raw.reduce((sum, weight) => sum + weight);
  return { weights: raw.map((weight) => weight / total), times_s: shaper.periods.map((part) => part / (mode.hz * root)) };
}

/** What a vibration keeps: 0 .. 1. */
export function residual(shape: Impulses, mode: Mode): number {
  const omega = 2 * Math.PI * mode.hz;
  const damped = omega * Math.sqrt(1 - mode.damping ** 2);
  const late = shape.times_s.at(-1)!;
  const parts = shape.weights.map((weight, i) => weight * Math.exp(mode.damping * omega * (shape.times_s[i]! - late)));
  const along = (wave: (phase: number) => number): number => parts.reduce((sum, part, i) => sum + part * wave(damped * shape.times_s[i]!), 0);
  return Math.hypot(along(Math.cos), along(Math.sin));
}

/** By which the axis is late at constant speed. */
export function delay_s(shape: Impulses): number {
  return shape.weights.reduce((sum, weight, i) => sum + weight * shape.times_s[i]!, 0);
}

/** The deviation in a curve with this acceleration. */
export function rounding_mm(shape: Impulses, acceleration_mm_s2: number): number {
  const mean = delay_s(shape);
  return (acceleration_mm_s2 * shape.weights.reduce((sum, weight, i) => sum + weight * (shape.times_s[i]! - mean) ** 2, 0)) / 2;
}

/** At the frequency, and the larger one of both ends of the spread. */
export function leaves(shaper: Shaper, mode: Mode): { here: number; off: number } {
  const shape = impulses(shaper, mode);
  const at = (factor: number): number => residual(shape, { ...mode, hz: mode.hz * factor });
  return { here: at(1), off: Math.max(at(1 - SPREAD), at(1 + SPREAD)) };
}

/** The shortest one that is good within the spread; the widest when no shaper is. */
export function recommended(mode: Mode): Shaper {
  const good = SHAPERS.find((shaper) => {
    const { here, off } = leaves(shaper, mode);
    return Math.max(here, off) <= GOOD;
  });
  return good ?? SHAPERS.at(-1)!;
}

export interface Waves {
  feed_mm_min: number;
  waves: number;
  distance_mm: number;
  /** Heights of the first and the last of these waves, in one unit; NaN: not measured. */
  first: number;
  last: number;
}

/** The vibration that drew the waves, or what is wrong with the measurement. */
export function measured(waves: Waves): Mode | string {
  const { feed_mm_min, waves: count, distance_mm, first, last } = waves;
  if (![feed_mm_min, count, distance_mm].every((value) => value > 0 && Number.isFinite(value)))
    return t`Enter the feed, the number of waves, and their distance.`;
  const heights = [first, last].filter((height) => !Number.isNaN(height)).length;
  if (heights === 1) return t`The damping needs both heights, or neither.`;
  if (heights === 2 && !(last > 0 && Number.isFinite(first))) return t`Heights must be more than 0.`;
  if (heights === 2 && last > first) return t`The last wave is higher than the first one: measure away from the corner.`;
  const decrement = Math.log(first / last) / count;
  const damping = heights === 2 ? decrement / Math.hypot(2 * Math.PI, decrement) : Number(row("shaper_damping").default);
  const hz = (count * feed_mm_min * MM_S_PER_MM_MIN) / distance_mm / Math.sqrt(1 - damping ** 2);
  return outside("shaper_hz", hz, `${hz.toPrecision(4)} Hz`) || outside("shaper_damping", damping, t`a damping of ${damping.toFixed(3)}`) || { hz, damping };
}

/** Why a setting cannot have this value; "": it can. */
function outside(name: string, value: number, words: string): string {
  const { min, max } = row(name);
  return value >= min && value <= max ? "" : t`This is ${words}: the shapers take ${min} to ${max}.`;
}

function row(name: string): SettingRow {
  const number = settingNumber(name);
  return settingsOf(AXES.length).find((setting) => setting.number === number)!.row;
}

/** $N -> text of the three settings of an axis. */
export function assignments(axis: number, shaper: Shaper, mode: Mode): Map<number, string> {
  const values = { shaper: shaper.value, shaper_hz: mode.hz, shaper_damping: mode.damping };
  return new Map(Object.entries(values).map(([name, value]) => [settingNumber(name) + axis, settingText(row(name), value)]));
}
