/** The positions of G28 and G30, from the page: up first, then across, then down to the stored height. Pure. */
import { AXES } from "../tables";
import { clear, outside, rate, type ZeroFacts, type ZeroPlan } from "./zero";
import { t } from "../words";

export type StoredName = "G28" | "G30";
const [X, Y, Z] = [0, 1, 2];
const ROUNDING_MM = 0.005;

/** Positions are machine coordinates: those of a machine that was not homed name no place. "": they do. */
export function unknownPlace(facts: Pick<ZeroFacts, "homed" | "axisCount">): string {
  const missing = [...AXES.slice(0, Math.min(facts.axisCount, 3))].filter((axis) => !facts.homed.includes(axis));
  return missing.length > 0 ? t`Home the machine first: stored positions are machine coordinates.` : "";
}

/** As planZero(): `$J=` lines that Hold cancels, each when the machine rests. */
export function planStored(name: StoredName, place_mm: readonly number[] | undefined, facts: ZeroFacts): ZeroPlan {
  const unknown = unknownPlace(facts);
  if (unknown) return { kind: "refuse", why: unknown };
  if (!place_mm || place_mm.every((value) => value === 0)) return { kind: "refuse", why: t`No position is stored for ${name}. Move there, and press Set.` };
  for (const axis of [X, Y, Z].slice(0, facts.axisCount)) {
    const why = outside(facts, axis, place_mm[axis] ?? 0, `The ${AXES[axis]} of ${name}`);
    if (why) return { kind: "refuse", why };
  }
  const jog = (words: string, feed: number): string => `$J=G53G21G90${words}F${number(feed)}`;
  const across = jog(`X${number(place_mm[X]!)}Y${number(place_mm[Y] ?? 0)}`, rate(facts, X) + rate(facts, Y));
  if (facts.axisCount <= Z) return { kind: "go", lines: [across], z_mm: null };
  const [z_mm, top_mm] = [facts.machine_mm[Z]!, -clear(facts)];
  const up = z_mm < top_mm - ROUNDING_MM ? [jog(`Z${number(top_mm)}`, rate(facts, Z))] : [];
  return { kind: "go", lines: [...up, across, jog(`Z${number(place_mm[Z]!)}`, rate(facts, Z))], z_mm: up.length > 0 ? top_mm : null };
}

function number(value: number): string {
  return String(Number(value.toFixed(3)));
}
