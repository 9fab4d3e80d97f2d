/** The board that is set up. The boards are large, so this comes with its first use: the tabs that set a board up have
 * it, and all else gets it by import(). */
import { computed, signal } from "@preact/signals";
import { served, store, stored } from "./app";
import { BOARDS, findBoard } from "./boards";
import type { Board } from "./tables";

const KEY = "wificnc.board";

/** The core as a computer runs it, which takes the settings of every machine. */
export const HOST = findBoard("host") ?? BOARDS[0]!;

const FIRST_BOARD = BOARDS.find((entry) => entry.target === "esp32")!;
const kept = findBoard(stored(KEY) ?? "") ?? FIRST_BOARD;
const chosen = signal<Board | null>(null);

/** Chosen here, else the one that serves the page; a computer's pins are no one's to set up. */
export const board = computed<Board>(() => {
  const own = findBoard(served.value?.board ?? "");
  return chosen.value ?? (own && own.target !== "host" ? own : kept);
});

export function chooseBoard(id: string): void {
  const found = findBoard(id);
  if (!found) return;
  chosen.value = found;
  store(KEY, id);
}
