/** The languages that the page has. Each has its catalogues in web/words; English is in the source. Pure. */

export const LANGUAGES = { en: "English", de: "Deutsch", es: "Español" } as const;
export type Language = keyof typeof LANGUAGES;

export function isLanguage(text: string | null): text is Language {
  return text !== null && text in LANGUAGES;
}

/** The first of the browser's languages that the page has, whatever the country. */
export function languageOf(wanted: readonly string[]): Language {
  return wanted.map((tag) => tag.toLowerCase().split("-")[0]!).find(isLanguage) ?? "en";
}
