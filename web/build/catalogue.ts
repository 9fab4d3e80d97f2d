/** `import("virtual:catalogue/page.de")`: the catalogues of web/words, by the hash of the English text. */
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Plugin } from "vite";
import { hashOf } from "../src/words.ts";

const NAME = "virtual:catalogue/";
const FOLDER = join(import.meta.dirname, "../words");
/** Files of which a catalogue is made, without language and end. */
const PARTS: Record<string, readonly string[]> = { page: ["page", "tables"], boards: ["boards"], contact: ["contact"] };

/** @param name  such as page.de. Throws when two texts have the same hash: then one of them must be worded otherwise. */
export function catalogueOf(name: string): Record<string, string> {
  const [part = "", language = ""] = name.split(".");
  const texts = (PARTS[part] ?? []).flatMap((file) => Object.entries(readWords(file, language)));
  const english = new Map<string, string>();
  for (const [key] of texts) {
    const other = english.get(hashOf(key));
    if (other !== undefined && other !== key) throw new Error(`"${key}" and "${other}" have the same hash`);
    english.set(hashOf(key), key);
  }
  return Object.fromEntries(texts.filter(([key, text]) => text !== "" && key !== text).map(([key, text]) => [hashOf(key), text]));
}

/** English -> other language; "" is not translated yet, as a text that is missing is. */
export function readWords(file: string, language: string): Record<string, string> {
  return JSON.parse(readFileSync(join(FOLDER, `${file}.${language}.json`), "utf8")) as Record<string, string>;
}

export function catalogues(): Plugin {
  return {
    name: "wificnc-catalogues",
    resolveId: (id) => (id.startsWith(NAME) ? `\0${id}` : null),
    load: (id) => (id.startsWith(`\0${NAME}`) ? `export default ${JSON.stringify(catalogueOf(id.slice(NAME.length + 1)))};` : null),
  };
}
