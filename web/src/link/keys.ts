/** Keys that act immediately, by the words on their buttons in the page. */
import type { RealtimeName } from "../tables";
import { msg, t, tr } from "../words";

const KEYS: Partial<Record<RealtimeName, string>> = {
  HOLD: msg`Hold`,
  RESUME: msg`Resume`,
  RESET: msg`Reset`,
  DOOR: msg`Door`,
  PARK: msg`Jog, probe or zero here`,
};

/** Of those that have many buttons: the kind alone. */
const KINDS: readonly [RegExp, string][] = [
  [/^FEED_/, msg`Feed`],
  [/^RAPID_/, msg`Rapid`],
  [/^SPINDLE_/, msg`Spindle`],
  [/^FLOOD/, msg`Flood`],
  [/^MIST/, msg`Mist`],
];

export function keyWords(name: RealtimeName): string {
  const word = KEYS[name] ?? KINDS.find(([pattern]) => pattern.test(name))?.[1];
  return word ? tr(word) : t`another button`;
}

/** Each once, in the order in which they were pressed. */
export function keysWords(names: readonly RealtimeName[]): string {
  return [...new Set(names.map(keyWords))].join(", ");
}
