/** What was pressed and not sent is named as its button is, in each language. */
import { readFileSync } from "node:fs";
import { afterEach, expect, test } from "vitest";
import { keysWords } from "../src/link/keys";
import { TABLES, type RealtimeName } from "../src/tables";
import { hashOf, useCatalogue } from "../src/words";

function words(language: string): Record<string, string> {
  if (language === "en") return {};
  return JSON.parse(readFileSync(new URL(`../words/page.${language}.json`, import.meta.url), "utf8")) as Record<string, string>;
}

afterEach(() => useCatalogue(() => ({})));

test.each(["en", "de", "es"])("%s: the words of the buttons", (language) => {
  const page = words(language);
  useCatalogue(() => Object.fromEntries(Object.entries(page).map(([text, word]) => [hashOf(text), word])));
  const word = (text: string): string => (language === "en" ? text : page[text]!);
  expect(keysWords(["HOLD", "RESET", "RESUME"])).toBe([word("Hold"), word("Reset"), word("Resume")].join(", "));
  expect(keysWords(["FEED_PLUS_10", "HOLD", "FEED_100"])).toBe(`${word("Feed")}, ${word("Hold")}`);
  for (const name of Object.keys(TABLES.realtime)) expect(keysWords([name as RealtimeName])).not.toContain("_");
  expect(keysWords(["PARK"])).toBe(word("Jog, probe or zero here"));
});

test("the notices and the log use these words", () => {
  for (const file of ["view/header.tsx", "link/controller.ts"]) {
    const source = readFileSync(new URL(`../src/${file}`, import.meta.url), "utf8");
    expect(source).not.toMatch(/dropped(?:\.value)?\.join|not answer: \$\{name\}/);
  }
});
