/**
 * The sign of a press that was not taken: an outline of the control, and a text next to it that readers announce politely. Both lie
 * over the page, move nothing, take no presses, and go by themselves.
 */
import { t } from "./words";

/** It has just appeared, moved or changed; or another control was pressed at this place a moment ago. */
export type Refusal = "settling" | "place";

const SHOWN_MS = 2000;
/** Between the text, the control and the edge of the window, px. */
const GAP_PX = 6;

let note: HTMLElement | null = null;
let marked: Element | null = null;
let timer: ReturnType<typeof setTimeout> | undefined;

function words(why: Refusal, wait_s: number): string {
  if (why === "settling") return t`Not taken: this button has just appeared or changed. Press it again.`;
  return t`Not taken: another button was here. Wait ${wait_s} s, then press it.`;
}

/** @param wait_s  after a press at its place */
export function showIgnored(control: Element, why: Refusal, wait_s: number): void {
  marked?.removeAttribute("data-ignored");
  marked = control;
  control.setAttribute("data-ignored", "");
  place(noteIn(control.closest("dialog[open]") ?? document.body), control, words(why, wait_s));
  clearTimeout(timer);
  timer = setTimeout(hide, SHOWN_MS);
}

function hide(): void {
  marked?.removeAttribute("data-ignored");
  marked = null;
  if (note) note.textContent = "";
}

/** A modal dialog hides what is outside of it, from readers, too. */
function noteIn(parent: Element): HTMLElement {
  note ??= Object.assign(document.createElement("p"), { className: "ignored-note" });
  note.setAttribute("role", "status");
  if (note.parentElement !== parent) parent.append(note);
  return note;
}

function place(text: HTMLElement, control: Element, words: string): void {
  if (text.textContent !== words) text.textContent = words;
  const [box, size] = [control.getBoundingClientRect(), text.getBoundingClientRect()];
  const top = box.top - size.height - GAP_PX;
  const left = box.left + box.width / 2 - size.width / 2;
  text.style.top = `${top >= GAP_PX ? top : box.bottom + GAP_PX}px`;
  text.style.left = `${Math.max(GAP_PX, Math.min(left, document.documentElement.clientWidth - size.width - GAP_PX))}px`;
}
