import { readFileSync } from "node:fs";
import { afterEach, expect, test } from "vitest";
import { catalogueOf, readWords } from "../build/catalogue.ts";
import { allTexts, textsOf } from "../build/texts.ts";
import { untranslated, wanted, wrongWords } from "../build/wanted.ts";
import { REFUSALS } from "../src/contact/refusals.ts";
import { LANGUAGES, languageOf } from "../src/languages.ts";
import { alarmWords, pinRefusal, type Board } from "../src/tables.ts";
import { hashOf, msg, t, tr, useCatalogue } from "../src/words.ts";

const OTHERS = Object.keys(LANGUAGES).filter((language) => language !== "en");

afterEach(() => useCatalogue(() => ({})));

/** Never translated: G-code that is shown, files, selectors of CSS, words of the controller that are looked for. */
const NO_TEXT = [
  /^\(prefers-color-scheme: dark\)$/,
  /^input:not\(\[type=checkbox\]\), select, textarea, \[role=tab\]$/,
  /^button, (summary|a, input, select, textarea, summary, label)$/,
  /^11px system-ui, sans-serif$/,
  /^(linear-gradient|scale|translate)\(/,
  /^(any|end|middle)$/, // values of attributes
  /^\$J=G53G21G90\{0\}\(middle of \{1\}\)F\{2\}$/,
  /^G21G43\.1Z\(contact less that of the reference\)$/,
  /^G21G10L20P0\{0\}\(position against \{1\}\)$/,
  /^start \{0\}$/, // a contact's name
  /^(access key|not signed|another chip|another product)$/, // in a refusal of the controller
  /^# Settings of \{0\}\.$|^\[other\] # of this firmware only$/, // in a file
  /^USB serial port$|^WiFiCNC login\0+$|^2-hump EI$/,
  /^The table of settings has no \{0\}\.$/, // a mistake of a programmer
];

test("each text that people read goes through the catalogue", () => {
  const bare = allTexts().bare.filter(({ text }) => !NO_TEXT.some((exempt) => exempt.test(text)));
  expect(bare.map(({ file, line, text }) => `${file}:${line}: use t\`${text}\``)).toEqual([]);
});

test("a text that is not in the catalogue is found wherever it is", () => {
  const found = (code: string): string[] => textsOf("a.tsx", code).bare.map(({ text }) => text);
  expect(found("const a = <b>Two words</b>;")).toEqual(["Two words"]);
  expect(found("const a = <b title='Word' class='soft small'>{on ? 'yes' : x}</b>;")).toEqual(["Word", "yes"]);
  expect(found("const a = <b label={`Jog ${x}`} />;")).toEqual(["Jog {0}"]);
  expect(found("throw new Error('The port is closed');")).toEqual(["The port is closed"]);
  expect(found("const a = { title: 'Control', icon: 'control' };")).toEqual(["Control"]);
  expect(found("const a = <b onClick={() => say('It is done.')} data-test='to be done' />;")).toEqual(["It is done."]);
  expect(found("const a = <b>{t`Two words`}{n} mm</b>; use('idle', `G1X${x}Y2`);")).toEqual(["mm"]);
  expect(textsOf("a.ts", "t`Line ${n} of ${all}`").tagged.map(({ text }) => text)).toEqual(["Line {0} of {1}"]);
});

test.each(OTHERS)("each translation in %s is of a text of the page, with the same values", (language) => {
  for (const [file, texts] of Object.entries(wanted())) expect(wrongWords(texts, readWords(file, language)), `${file}.${language}.json`).toEqual([]);
});

test("a translation that is wrong is found, and one that is missing is listed", () => {
  const texts = new Set(["Line {0} of {1}", "Send"]);
  expect(wrongWords(texts, { "Line {0} of {1}": "{1}: {0}" })).toEqual([]);
  expect(wrongWords(texts, { "Line {0} of {1}": "Zeile {0}" })).toEqual(["other values or blanks at an end: Line {0} of {1}"]);
  expect(wrongWords(texts, { Send: "Senden " })).toEqual(["other values or blanks at an end: Send"]);
  expect(wrongWords(texts, { Sent: "Gesendet" })).toEqual(["not a text of the page: Sent"]);
  expect(untranslated("page", new Set(["Settings", "Nothing like it"]), "de")).toEqual(["Nothing like it"]);
});

/** What is the same in each language: commands, pins and other names with a number, pages of a data sheet. */
function names(text: string): string[] {
  return [...text.matchAll(/`[^`]+`|[A-Z]+\d+|\((?:Section|Table) [^)]*/g)].map(([name]) => name).sort();
}

test.each(OTHERS)("the notes of the boards in %s have the same pins and commands", (language) => {
  const written = Object.entries(readWords("boards", language)).filter(([, other]) => other !== "");
  const wrong = written.filter(([text, other]) => `${names(text)}` !== `${names(other)}`);
  expect(wrong).toEqual([]);
});

test("the texts of a board file that no catalogue has are shown in English", () => {
  const words = catalogueOf("boards.de");
  useCatalogue(() => words);
  expect(tr("My own mill: the probe is at J7.")).toBe("My own mill: the probe is at J7.");
  expect(tr("{0} is wired to my lamp", "GPIO4")).toBe("GPIO4 is wired to my lamp");
});

test.each([
  ["en", "GPIO25 is the board's X step; GPIO25 cannot be read on ESP32 and this is an input"],
  ["de", "GPIO25 ist bei dieser Platine X Schritt; GPIO25 lässt sich auf dem ESP32 nicht lesen, und dies ist ein Eingang"],
  ["es", "GPIO25 es en esta placa X paso; GPIO25 no se puede leer en el ESP32, y esto es una entrada"],
])("why a pin is unsuitable, in %s", (language, text) => {
  const words = language === "en" ? {} : { ...catalogueOf(`page.${language}`), ...catalogueOf(`boards.${language}`) };
  useCatalogue(() => words);
  const board = { uses: [{ label: "X step", number: 25 }] } as Board;
  const pin = { name: "GPIO25", number: 25, output: [], input: ["{0} cannot be read on ESP32 and this is an input"] };
  expect(pinRefusal(board, pin, false)).toBe(text);
  expect(pinRefusal(board, { ...pin, output: null }, true)).toBe(null);
});

test.each(OTHERS)("the catalogue of %s answers each text with its translation", (language) => {
  for (const [part, files] of Object.entries({ "page boards": ["page", "tables", "boards"], contact: ["contact"] })) {
    const words = Object.assign({}, ...part.split(" ").map((name) => catalogueOf(`${name}.${language}`))) as Record<string, string>;
    useCatalogue(() => words);
    for (const [text, other] of files.flatMap((file) => Object.entries(readWords(file, language)))) expect(tr(text)).toBe(other || text);
  }
});

test("what a controller refuses in the first contact is in the catalogue", () => {
  const source = readFileSync("../targets/esp32/net/portal.c", "utf8");
  const answers = new Set([...source.matchAll(/"([A-Z][^"\\]{15,}\.)"/g)].map(([, text]) => text!));
  expect(answers.size).toBeGreaterThan(10);
  expect([...answers].sort()).toEqual([...REFUSALS].sort());
});

test("values are put where the language has them, and a text without a translation stays", () => {
  expect(t`Line ${3} of ${"{0}"}`).toBe("Line 3 of {0}");
  expect(tr(msg`plain`)).toBe("plain");
  const words = { [hashOf("{0} of {1} lines")]: "{1}: {0}" };
  useCatalogue(() => words);
  expect(t`${1} of ${2} lines`).toBe("2: 1");
  expect(alarmWords(-1)).toBe("unknown alarm");
});

test.each([
  [["de-AT", "en"], "de"],
  [["es-419"], "es"],
  [["fr", "ES", "en"], "es"],
  [["fr-CA", "ja"], "en"],
  [["en-GB", "de"], "en"],
  [[], "en"],
])("the browser's languages %j: %s", (tags, language) => expect(languageOf(tags)).toBe(language));
