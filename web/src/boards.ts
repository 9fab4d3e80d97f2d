/** The boards that the page knows. Apart from the other tables, which the preflight's worker has, too: they are larger. */
import raw from "../../build/generated/boards.json";
import type { Board } from "./tables";

export const BOARDS = raw as Board[];

export function findBoard(id: string): Board | undefined {
  return BOARDS.find((board) => board.id === id);
}
