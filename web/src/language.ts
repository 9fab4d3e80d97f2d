/** The language of the page: the browser's, or the one that was chosen here. */
import { signal } from "@preact/signals";
import { stored, store } from "./app";
import { isLanguage, languageOf, type Language } from "./languages";
import { useCatalogue, type Catalogue } from "./words";

const LANGUAGE_KEY = "wificnc.language";
type Catalogues = Record<Exclude<Language, "en">, () => Promise<{ default: Catalogue }>>;
const CATALOGUES: Catalogues = {
  de: () => import("virtual:catalogue/page.de"),
  es: () => import("virtual:catalogue/page.es"),
};
const OF_BOARDS: Catalogues = {
  de: () => import("virtual:catalogue/boards.de"),
  es: () => import("virtual:catalogue/boards.es"),
};
let showsBoards = false;

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

/** Texts of boards are large, so they come with the first tab that shows them. Without them they are in English. */
export async function addBoardWords(): Promise<void> {
  showsBoards = true;
  const now = language.value;
  const all = await catalogueOf(now).catch(() => null);
  if (all && language.value === now) words.value = all;
}

async function catalogueOf(wanted: Language): Promise<Catalogue> {
  if (wanted === "en") return {};
  const loads = showsBoards ? [CATALOGUES, OF_BOARDS] : [CATALOGUES];
  const loaded = await Promise.all(loads.map((load) => load[wanted]()));
  return Object.assign({}, ...loaded.map((part) => part.default)) as Catalogue;
}

async function show(wanted: Language): Promise<void> {
  words.value = await catalogueOf(wanted);
  language.value = wanted;
  document.documentElement.lang = wanted;
}
