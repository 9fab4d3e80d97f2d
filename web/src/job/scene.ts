/**
 * What is drawn of a path: `wificnc sim --plot` draws the same, and both look as cli/wificnc/simulator/look.py says. Pure.
 */
import { TABLES } from "../tables";
import { PIECE_WORDS, SAMPLE_WORDS, type Report } from "./core";
import { AT_FROM, AT_TO, engravingOf, type Engraving } from "./engraving";

const LOOK = TABLES.look;
const MAX_PASSES = 16;
/** Words of a sample: seconds, X and what follows it, speed in mm/s, rapid. */
const [AT_S, AT_X, AT_SPEED, AT_RAPID] = [0, 1, 7, 8] as const;
const SECONDS_A_MINUTE = 60;

export const RAPID = -1;

/** Points and how each was reached: the segment before a point has its level. */
export interface Scene {
  seconds: Float32Array;
  /** Three numbers a point, mm. */
  points: Float32Array;
  /** 0 .. TABLES.look.speed.levels of the fastest cut, or RAPID. */
  levels: Int8Array;
  /** Of the cuts; of the rapids when there are no cuts; 1 when nothing moves. */
  topSpeed_mm_min: number;
  /** Points reached by a cut straight up or down, one for each place. */
  plunges: Uint32Array;
  /** Of a laser: takes the place of the cuts. */
  engraving: Engraving | null;
}

/**
 * The scene of a path of SAMPLE_WORDS words a sample, which has gone so far, and of what a laser burnt on it. Both are
 * changed: their zero comes to `origin_mm`.
 */
export function sceneOf(
  samples: Float32Array,
  pieces: Float32Array,
  { min_mm, max_mm }: Pick<Report, "min_mm" | "max_mm">,
  origin_mm: readonly number[] = [],
): Scene {
  move(samples, SAMPLE_WORDS, AT_X, origin_mm);
  for (const at of [AT_FROM, AT_TO]) move(pieces, PIECE_WORDS, at, origin_mm);
  const kinds = new Uint32Array(samples.buffer, samples.byteOffset, samples.length);
  const topSpeed_mm_min = topSpeed(samples, kinds);
  const all = allLevels(samples, kinds, topSpeed_mm_min);
  const extent_mm = Math.max(1e-3, ...[0, 1, 2].map((n) => max_mm[n]! - min_mm[n]!));
  const kept = simplify(samples, all, extent_mm / LOOK.accuracy_parts);
  const points = new Float32Array(kept.length * 3);
  kept.forEach((from, to) => points.set(samples.subarray(from * SAMPLE_WORDS + AT_X, from * SAMPLE_WORDS + AT_X + 3), to * 3));
  const seconds = Float32Array.from(kept, (i) => samples[i * SAMPLE_WORDS + AT_S]!);
  const levels = Int8Array.from(kept, (i) => all[i]!);
  return { seconds, points, levels, topSpeed_mm_min, plunges: plungesOf(points, levels), engraving: engravingOf(pieces) };
}

function move(rows: Float32Array, size: number, at: number, origin_mm: readonly number[]): void {
  const [x, y, z] = [origin_mm[0] ?? 0, origin_mm[1] ?? 0, origin_mm[2] ?? 0];
  if (x === 0 && y === 0 && z === 0) return;
  for (let i = at; i < rows.length; i += size) {
    rows[i]! -= x;
    rows[i + 1]! -= y;
    rows[i + 2]! -= z;
  }
}

function allLevels(samples: Float32Array, kinds: Uint32Array, topSpeed_mm_min: number): Int8Array {
  const levels = new Int8Array(samples.length / SAMPLE_WORDS);
  for (let i = 0, at = 0; i < levels.length; i++, at += SAMPLE_WORDS) {
    const share = (samples[at + AT_SPEED]! * SECONDS_A_MINUTE) / topSpeed_mm_min;
    levels[i] = kinds[at + AT_RAPID]! ? RAPID : Math.min(Math.trunc(share * LOOK.speed.levels), LOOK.speed.levels);
  }
  return levels;
}

function topSpeed(samples: Float32Array, kinds: Uint32Array): number {
  let [cut, any, hasCut] = [0, 0, false];
  for (let at = 0; at < samples.length; at += SAMPLE_WORDS) {
    const speed = samples[at + AT_SPEED]!;
    any = Math.max(any, speed);
    if (kinds[at + AT_RAPID]) continue;
    hasCut = true;
    cut = Math.max(cut, speed);
  }
  return Math.max((hasCut ? cut : any) * SECONDS_A_MINUTE, 1);
}

/** Drops points that lie on the chord of their neighbours, where the level stays; every second point at a time. */
function simplify(samples: Float32Array, levels: Int8Array, tolerance_mm: number): Uint32Array {
  let kept = Uint32Array.from(levels, (_, i) => i);
  for (let pass = 0; pass < MAX_PASSES; pass++) {
    const next = new Uint32Array(kept.length);
    const first = 1 + (pass % 2);
    let to = 0;
    for (let i = 0; i < kept.length; i++) {
      const isMiddle = i >= first && i + 1 < kept.length && (i - first) % 2 === 0;
      const [here, after] = [kept[i]!, kept[i + 1]!];
      if (!isMiddle || levels[here] !== levels[after] || chordDistance(samples, kept[i - 1]!, here, after) >= tolerance_mm) next[to++] = here;
    }
    kept = next.slice(0, to);
  }
  return kept;
}

/** Distance of a point from the segment between two others. Called millions of times: nothing is allocated. */
function chordDistance(samples: Float32Array, begin: number, point: number, end: number): number {
  const [a, p, b] = [begin * SAMPLE_WORDS + AT_X, point * SAMPLE_WORDS + AT_X, end * SAMPLE_WORDS + AT_X];
  const [ax, ay, az] = [samples[a]!, samples[a + 1]!, samples[a + 2]!];
  const [cx, cy, cz] = [samples[b]! - ax, samples[b + 1]! - ay, samples[b + 2]! - az];
  const [wx, wy, wz] = [samples[p]! - ax, samples[p + 1]! - ay, samples[p + 2]! - az];
  const square = cx * cx + cy * cy + cz * cz;
  const along = Math.min(1, Math.max(0, (wx * cx + wy * cy + wz * cz) / (square || 1)));
  const [dx, dy, dz] = [wx - along * cx, wy - along * cy, wz - along * cz];
  return Math.sqrt(dx * dx + dy * dy + dz * dz);
}

function plungesOf(points: Float32Array, levels: Int8Array): Uint32Array {
  const found = new Map<string, number>();
  for (let i = 1; i < levels.length; i++) {
    const [dx, dy, dz] = [0, 1, 2].map((n) => Math.abs(points[i * 3 + n]! - points[i * 3 - 3 + n]!)) as [number, number, number];
    if (levels[i] === RAPID || dz <= LOOK.plunge_steepness * Math.hypot(dx, dy)) continue;
    const place = `${points[i * 3]!.toFixed(3)} ${points[i * 3 + 1]!.toFixed(3)}`;
    if (!found.has(place)) found.set(place, i);
  }
  return Uint32Array.from(found.values());
}

/** The colour of each level, 0 .. TABLES.look.speed.levels, of a speed or of an energy. */
export function levelColours(dark: boolean, of: "speed" | "engraving"): string[] {
  const stops = LOOK[of][dark ? "dark" : "light"].map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  return Array.from({ length: LOOK.speed.levels + 1 }, (_, level) => {
    const at = (level / LOOK.speed.levels) * (stops.length - 1);
    const [low, share] = [Math.min(Math.floor(at), stops.length - 2), at - Math.min(Math.floor(at), stops.length - 2)];
    return `rgb(${stops[low]!.map((value, n) => Math.round(value + share * (stops[low + 1]![n]! - value))).join(" ")})`;
  });
}

/** Width of a cut, px: dense jobs want finer lines. */
export function cutWidth(segments: number): number {
  const [[few, wide], [many, fine]] = LOOK.cut_widths as [[number, number], [number, number]];
  const share = (Math.log10(Math.max(segments, 1)) - few) / (many - few);
  return wide + Math.min(1, Math.max(0, share)) * (fine - wide);
}
