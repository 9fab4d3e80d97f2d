/** What a laser burns: `wificnc sim --plot` draws the same (cli/wificnc/simulator/engraving.py). Pure. */
import { TABLES } from "../tables";
import { PIECE_WORDS, type Report } from "./core";
import { t } from "../words";

const LOOK = TABLES.look.engraving;
const LEVELS = TABLES.look.speed.levels;
export const [AT_FROM, AT_TO, AT_LENGTH, AT_ENERGY] = [1, 4, 7, 8] as const;
const MS_PER_S = 1000;

export interface Engraving {
  /** When each piece ends. */
  seconds: Float32Array;
  /** Six numbers a piece: where it begins and ends, mm. */
  ends: Float32Array;
  /** 0 .. TABLES.look.speed.levels, which is black; AT_REST: a dot. */
  levels: Int8Array;
  /** This energy and more is black: ms of full power per mm. */
  black: number;
  /** Of all pieces. */
  length_mm: number;
}

export const AT_REST = -1;

/** Of pieces of PIECE_WORDS words; null: nothing was burnt. */
export function engravingOf(pieces: Float32Array): Engraving | null {
  const count = pieces.length / PIECE_WORDS;
  if (count === 0) return null;
  const lengths = column(pieces, AT_LENGTH);
  const energies = column(pieces, AT_ENERGY).map((energy, i) => (energy * MS_PER_S) / lengths[i]!);
  const black = LOOK.black * typicalOf(energies, lengths);
  const level = (energy: number, i: number): number => (lengths[i]! > 0 ? Math.min(LEVELS, Math.round((energy / black) * LEVELS)) : AT_REST);
  const ends = new Float32Array(count * 6);
  for (let i = 0; i < count; i++) ends.set(pieces.subarray(i * PIECE_WORDS + AT_FROM, i * PIECE_WORDS + AT_TO + 3), i * 6);
  return {
    seconds: Float32Array.from(column(pieces, 0)),
    ends,
    levels: Int8Array.from(energies, level),
    black,
    length_mm: lengths.reduce((sum, mm) => sum + mm, 0),
  };
}

function column(pieces: Float32Array, word: number): Float64Array {
  return Float64Array.from({ length: pieces.length / PIECE_WORDS }, (_, i) => pieces[i * PIECE_WORDS + word]!);
}

/** As much energy by length as all but a few mm of the path get. */
function typicalOf(energies: Float64Array, lengths: Float64Array): number {
  const order = Uint32Array.from(lengths.keys()).filter((i) => lengths[i]! > 0);
  order.sort((a, b) => energies[a]! - energies[b]!);
  const enough = LOOK.quantile * order.reduce((sum, i) => sum + lengths[i]!, 0);
  let sum = 0;
  for (const i of order) {
    sum += lengths[i]!;
    if (sum >= enough) return energies[i]!;
  }
  return 1;
}

/** What constant power burns too much, and how to avoid it; null: nothing. */
export function laserWarning(
  { engraving: burnt }: Pick<Report, "engraving">,
  origin_mm: readonly number[] = [],
): { title: string; text: string } | null {
  if (burnt.slow_mm === 0) return null;
  const place = burnt.worst_mm.map((mm, i) => `${TABLES.axes[i]}${(mm - (origin_mm[i] ?? 0)).toFixed(3)}`).join(" ");
  return {
    title: t`Constant power (M3) burns more where the machine is slower than F`,
    text: t`More than ${burnt.limit} x the energy of the feed on ${burnt.slow_mm.toFixed(1)} mm of ${burnt.constant_mm.toFixed(1)} mm, at most ${burnt.worst.toFixed(1)} x in line ${burnt.worst_line} at ${place}. Use M4, whose power follows the speed, or a lower F, or overscan: begin and end lines outside of the picture with S0.`,
  };
}
