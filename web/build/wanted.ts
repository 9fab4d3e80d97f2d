/** The English texts that the page shows, by the file of their translations: what a language lacks, and what is wrong. */
import { readFileSync } from "node:fs";
import { join } from "node:path";
import boards from "../../build/generated/boards.json";
import { settingName, TABLES, type Board } from "../src/tables.ts";
import { readWords } from "./catalogue.ts";
import { allTexts, htmlTexts } from "./texts.ts";

const SETUP = join(import.meta.dirname, "../setup.html");
export type File = "page" | "tables" | "boards" | "contact";

/** What the page shows of the tables, by the file of its translations. */
function tableTexts(): string[] {
  const { settings, errors, alarms, storage } = TABLES;
  const rows = [...storage.text, ...storage.number].map((row) => row.help);
  const pins = [...storage.pin, ...(boards as unknown as Board[]).flatMap((board) => board.uses)].map((pin) => pin.label);
  const summaries = (boards as unknown as Board[]).map((board) => board.summary);
  const words = settings.flatMap((row) => [settingName(row), row.help, row.unit]);
  return [...words, ...Object.values(errors), ...Object.values(alarms), ...rows, ...pins, ...summaries].filter((text) => text !== "");
}

/** What the page shows of the board files alone. */
function boardTexts(): string[] {
  return (boards as unknown as Board[]).flatMap((board) => {
    const reasons = board.pins.flatMap((pin) => [...(pin.output ?? []), ...(pin.input ?? [])]);
    return [board.name, board.chip_name, ...board.notes, ...reasons];
  });
}

/** The English texts of each file of translations. */
export function wanted(): Record<File, Set<string>> {
  const { tagged } = allTexts();
  const ofContact = (file: string): boolean => file.startsWith("contact");
  const page = new Set(tagged.filter(({ file }) => !ofContact(file)).map(({ text }) => text));
  const contact = new Set(tagged.filter(({ file }) => ofContact(file)).map(({ text }) => text));
  for (const text of htmlTexts(readFileSync(SETUP, "utf8"))) contact.add(text);
  const tables = new Set(tableTexts().filter((text) => !page.has(text)));
  const ofBoards = new Set(boardTexts().filter((text) => !page.has(text) && !tables.has(text)));
  return { page, contact, tables, boards: ofBoards };
}

/** Texts that a language shows in English, for want of a translation. */
export function untranslated(file: File, texts: Set<string>, language: string): string[] {
  const words = readWords(file, language);
  return [...texts].filter((text) => !words[text]);
}

/** Keys that no text of the page is, and translations that have other values, or other blanks at an end, than their key. */
export function wrongWords(texts: Set<string>, words: Record<string, string>): string[] {
  const unknown = Object.keys(words).filter((text) => !texts.has(text));
  const other = Object.entries(words).filter(([text, translation]) => translation !== "" && shape(text) !== shape(translation));
  return [...unknown.map((text) => `not a text of the page: ${text}`), ...other.map(([text]) => `other values or blanks at an end: ${text}`)];
}

/** Placeholders in order, and blanks at the ends, which join it to its neighbours. */
function shape(text: string): string {
  const values = [...text.matchAll(/\{\d\}/g)].map(([value]) => value).sort();
  return `${/^\s*/.exec(text)![0]}${values.join("")}${/\s*$/.exec(text)![0]}`;
}
