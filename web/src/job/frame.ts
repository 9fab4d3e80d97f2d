/** The outline of a job: once around its bounds with the tool up, or with the laser at low power. Pure. */
import { AXES, settingNumber } from "../tables";
import type { Standing } from "./standing";
import { t } from "../words";

export interface Frame {
  /** One after the other, each when the machine rests; the last ones bring back what was before. */
  lines: string[];
  notes: string[];
}

export type FramePlan = { kind: "go"; frame: Frame } | { kind: "refuse"; why: string };

export interface FrameWish {
  feed_mm_min: number;
  /** Up from where Z is; 0: as it is. */
  lift_mm: number;
  /** Of the laser, percent of $30; 0: no light. */
  power_pct: number;
}

export const LASER_LIMIT_PCT = 5;

const SPINDLE_MAX = settingNumber("spindle_max_rpm");
const LASER_MODE = settingNumber("laser_mode");
const TRAVEL = settingNumber("max_travel_mm");
const [X, Y, Z] = [0, 1, 2];
const ROUNDING_MM = 0.005;

/** @param min_mm, max_mm  bounds of the job in machine coordinates */
export function planFrame(standing: Standing, min_mm: readonly number[], max_mm: readonly number[], wish: FrameWish): FramePlan {
  const laser = Number(standing.settings.get(LASER_MODE) ?? 0) > 0;
  if (standing.machine_mm.length === 0) return refuse(t`The controller has not reported its place and settings yet. Try again in a moment.`);
  if (!(wish.feed_mm_min >= 10 && wish.feed_mm_min <= 20_000)) return refuse(t`The feed must be from 10 to 20000 mm/min.`);
  if (!(wish.lift_mm >= 0 && wish.lift_mm <= 200)) return refuse(t`The lift must be from 0 to 200 mm: the outline never lowers Z.`);
  if (!(wish.power_pct >= 0 && wish.power_pct <= LASER_LIMIT_PCT)) return refuse(t`The power must be from 0 to ${LASER_LIMIT_PCT} %.`);
  if (wish.power_pct > 0 && !laser) return refuse(t`The laser needs laser mode ($${LASER_MODE}=1): without it this would turn a spindle.`);
  const lift_mm = standing.machine_mm.length > Z ? Math.min(wish.lift_mm, room(standing)) : 0;
  for (const axis of [X, Y]) {
    const why = outside(standing, axis, min_mm[axis]!, max_mm[axis]!);
    if (why) return refuse(why);
  }
  const corners: [number, number][] = [
    [min_mm[X]!, min_mm[Y]!],
    [max_mm[X]!, min_mm[Y]!],
    [max_mm[X]!, max_mm[Y]!],
    [min_mm[X]!, max_mm[Y]!],
    [min_mm[X]!, min_mm[Y]!],
  ];
  const begin: [number, number] = [standing.machine_mm[X]!, standing.machine_mm[Y]!];
  const jog = ([x, y]: [number, number]): string => `$J=G53G21G90X${number(x)}Y${number(y)}F${number(wish.feed_mm_min)}`;
  const up = lift_mm > 0 ? [`$J=G21G91Z${number(lift_mm)}F${number(Math.min(600, wish.feed_mm_min))}`] : [];
  const around = wish.power_pct > 0 ? lit(standing, corners.slice(1), wish) : corners.slice(1).map(jog);
  const down = lift_mm > 0 ? [`$J=G21G91Z${number(-lift_mm)}F${number(Math.min(600, wish.feed_mm_min))}`] : [];
  const unplaced = [X, Y].filter((axis) => !standing.homed.includes(AXES[axis]!)).map((axis) => AXES[axis]);
  const notes = unplaced.length > 0 ? [t`${unplaced.join(t` and `)}: not homed, so whether the outline stays within the travel is not known.`] : [];
  if (standing.machine_mm.length > Z && lift_mm < wish.lift_mm) notes.push(t`Z lifts by ${lift_mm.toFixed(1)} mm only: that is the end of its travel.`);
  return { kind: "go", frame: { lines: [...up, jog(corners[0]!), ...around, jog(begin), ...down], notes } };
}

/** M4, so that the laser is off when the machine rests. Modes come back with the last line. */
function lit(standing: Standing, corners: readonly [number, number][], wish: FrameWish): string[] {
  const power = (Number(standing.settings.get(SPINDLE_MAX) ?? 0) * wish.power_pct) / 100;
  const words = standing.modes.split(" ").filter((word) => /^(G9[01]|G2[01]|G9[345]|S[\d.]+)$/.test(word));
  const feed = standing.modes.split(" ").filter((word) => /^F[\d.]+$/.test(word) && words.includes("G94"));
  return [
    `G21G90G94M4S${number(power)}`,
    ...corners.map(([x, y]) => `G53G1X${number(x)}Y${number(y)}F${number(wish.feed_mm_min)}`),
    "M5",
    ["G0", ...words, ...feed].join(""),
  ];
}

/** How far Z can lift, mm. */
function room(standing: Standing): number {
  const isKnown = Number(standing.settings.get(TRAVEL + Z)) > 0 && standing.homed.includes("Z");
  return isKnown ? Math.max(0, Math.floor(-standing.machine_mm[Z]! * 1000) / 1000) : Infinity;
}

function outside(standing: Standing, axis: number, low_mm: number, high_mm: number): string {
  const travel_mm = Number(standing.settings.get(TRAVEL + axis) ?? 0) || 0;
  const name = AXES[axis]!;
  if (travel_mm <= 0 || !standing.homed.includes(name)) return "";
  if (low_mm >= -travel_mm - ROUNDING_MM && high_mm <= ROUNDING_MM) return "";
  return t`${name} would move from ${low_mm.toFixed(1)} to ${high_mm.toFixed(1)} mm in machine coordinates; its travel is from ${(-travel_mm).toFixed(1)} to 0.`;
}

function refuse(why: string): FramePlan {
  return { kind: "refuse", why };
}

function number(value: number): string {
  return String(Number(value.toFixed(3)));
}
