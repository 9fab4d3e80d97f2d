/**
 * The catalogue of messages, keyed by the English text as gettext's is: the source reads plainly, and a text without a
 * translation is shown in English. Also for workers, so nothing here needs a window.
 *
 *     t`Line ${n} is refused`        now, in the user's language; the key is "Line {0} is refused"
 *     msg`Settings`                  a text of a table: its key, to be translated where it is shown
 *     tr(row.title)                  there
 */

export type Catalogue = Readonly<Record<string, string>>;

const NOTHING: Catalogue = {};
let current: () => Catalogue = () => NOTHING;

/** Where texts come from: read at each use, so that a signal redraws what was drawn with it. */
export function useCatalogue(source: () => Catalogue): void {
  current = source;
}

/** All of it, to be handed to a worker. */
export function catalogue(): Catalogue {
  return current();
}

export function t(parts: TemplateStringsArray, ...values: readonly unknown[]): string {
  return tr(keyOf(parts), ...values);
}

/** A text that is shown elsewhere by tr(). */
export function msg(parts: TemplateStringsArray): string {
  return parts[0]!;
}

/** @param key  an English text, with {0}, {1} ... where values belong */
export function tr(key: string, ...values: readonly unknown[]): string {
  const text = current()[hashOf(key)] ?? key;
  return values.length === 0 ? text : text.replace(/\{(\d)\}/g, (_, n: string) => String(values[Number(n)]));
}

function keyOf(parts: TemplateStringsArray): string {
  return parts.reduce((key, part, i) => `${key}{${i - 1}}${part}`);
}

/** Catalogues have this instead of the English text, which the page has already: half their size. FNV-1a, 32 bits. */
export function hashOf(text: string): string {
  let hash = 0x811c9dc5;
  for (let i = 0; i < text.length; i++) hash = Math.imul(hash ^ text.charCodeAt(i), 0x01000193);
  return (hash >>> 0).toString(36);
}
