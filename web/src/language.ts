/** The language of the page: the browser's, or the one that was chosen here. */
import { signal } from "@preact/signals";
import { stored, store } from "./app";
import { isLanguage, languageOf, type Language } from "./languages";
import { useCatalogue, type Catalogue } from "./words";

const LANGUAGE_KEY = "wificnc.language";
const CATALOGUES: Record<Exclude<Language, "en">, () => Promise<{ default: Catalogue }>> = {
  de: () => import("virtual:catalogue/page.de"),
  es: () => import("virtual:catalogue/page.es"),
};

export const language = signal<Language>("en");
const words = signal<Catalogue>({});
useCatalogue(() => words.value);

/** Before anything is shown. A catalogue that cannot be loaded leaves the page in English. */
export async function startLanguage(): Promise<void> {
  const chosen = stored(LANGUAGE_KEY);
  await show(isLanguage(chosen) ? chosen : languageOf(navigator.languages)).catch(() => {});
}

/** Rejects when its catalogue cannot be loaded: the page stays as it is. */
export async function chooseLanguage(wanted: Language): Promise<void> {
  await show(wanted);
  store(LANGUAGE_KEY, wanted);
}

async function show(wanted: Language): Promise<void> {
  words.value = wanted === "en" ? {} : (await CATALOGUES[wanted]()).default;
  language.value = wanted;
  document.documentElement.lang = wanted;
}
