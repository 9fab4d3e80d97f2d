/** The laser at rest for a moment, and a spindle that runs warm: what may be done, and the lines. Pure. */
import { settingNumber } from "../tables";
import { t } from "../words";

const [LASER, AIM_POWER, AIM_TIME, MAX, MIN] = ["laser_mode", "aim_power_pct", "aim_time_s", "spindle_max_rpm", "spindle_min_rpm"].map(settingNumber) as [number, number, number, number, number];
const LONGEST_FIRE_S = 10;
export const LONGEST_STAGE_S = 1800;

type Settings = ReadonlyMap<number, string>;

function valueOf(settings: Settings, n: number): number {
  return Number(settings.get(n) ?? 0) || 0;
}

export function isLaser(settings: Settings): boolean {
  return valueOf(settings, LASER) > 0;
}

/** Per cent of $30 that the controller allows at rest; 0: none. */
export function firePower_pct(settings: Settings): number {
  return valueOf(settings, AIM_POWER);
}

/** The controller ends the beam by itself after $90. */
export function longestFire_s(settings: Settings): number {
  return Math.min(LONGEST_FIRE_S, valueOf(settings, AIM_TIME));
}

/** Why the laser cannot be tested; "": it can. The time limit of the controller holds when this page is gone. */
export function noFire(settings: Settings, power_pct: number, time_s: number): string {
  if (!isLaser(settings)) return t`The test needs laser mode ($${LASER}=1): without it this would turn a spindle.`;
  if (firePower_pct(settings) === 0) return t`The controller keeps the beam dark at rest: set $${AIM_POWER} to the highest power in % that you allow there.`;
  if (valueOf(settings, AIM_TIME) === 0) return t`Set $${AIM_TIME} to some seconds first: the controller then ends the beam even if this page is gone.`;
  if (!(power_pct > 0 && power_pct <= firePower_pct(settings))) return t`The power must be above 0 and at most ${firePower_pct(settings)} % ($${AIM_POWER}).`;
  if (!(time_s > 0 && time_s <= longestFire_s(settings))) return t`The time must be above 0 and at most ${longestFire_s(settings)} s.`;
  return "";
}

/** The beam at rest is lit in G1 alone. */
export function fireLine(settings: Settings, power_pct: number): string {
  return `G94G1F100M3S${number((valueOf(settings, MAX) * power_pct) / 100)}`;
}

/** Dark, and the words of the program as they were. @param modes  words of `$G` from before */
export function darkLines(modes: string): string[] {
  const words = modes.split(" ").filter((word) => /^(G[01]|G9[345]|S[\d.]+)$/.test(word));
  const feed = modes.split(" ").filter((word) => /^F[\d.]+$/.test(word) && words.includes("G94"));
  return ["M5", [...(words.some((word) => /^G[01]$/.test(word)) ? [] : ["G0"]), ...words, ...feed].join("")];
}

export interface Stage {
  rpm: number;
  time_s: number;
}

/** A quarter, half and all of the speed, a minute each. */
export function usualStages(settings: Settings): Stage[] {
  const [most, least] = [valueOf(settings, MAX), valueOf(settings, MIN)];
  return [0.25, 0.5, 1].map((part) => ({ rpm: Math.round(Math.max(most * part, least)), time_s: 60 }));
}

export function noStages(settings: Settings, stages: readonly Stage[]): string {
  if (isLaser(settings)) return t`This is a laser ($${LASER}=1).`;
  const most = valueOf(settings, MAX);
  const wrong = stages.find(({ rpm, time_s }) => !(rpm > 0 && rpm <= most && time_s > 0 && time_s <= LONGEST_STAGE_S));
  return wrong ? t`Speeds must be above 0 and at most ${most} rpm ($${MAX}), times above 0 and at most ${LONGEST_STAGE_S} s.` : "";
}

function number(value: number): string {
  return String(Number(value.toFixed(3)));
}
