/**
 * Which presses may act. A press that was meant for something else must not reach the machine, so a control that starts
 * or sets something is dead
 * - for SETTLE_MS after it has appeared, has moved, or has another meaning;
 * - for PLACE_MS after the last press at its place, if that press hit another control: a second press of Stop never starts;
 * - for a click whose pointer went down on something else.
 * What stops the machine is never dead. A press that does not act is shown as such (ignored.ts). Pure but for guardPresses().
 */
import { showIgnored, type Refusal } from "./ignored";

export const SETTLE_MS = 500;
export const PLACE_MS = 3000;
/** How far a second press at "the same place" may be off, px; and what counts as no move. */
const NEAR_PX = 20;
const STILL_PX = 4;

interface Point {
  x: number;
  y: number;
}

/** Where a control is, and what it would do now. */
export interface Look extends Point {
  meaning: string;
  enabled: boolean;
}

interface Place extends Point {
  meaning: string;
  at_ms: number;
}

export class PressGuard<Control extends object> {
  private looks = new Map<Control, Look & { since_ms: number }>();
  private places: Place[] = [];
  /** Why the last press did not act; null: it acted. */
  refusal: Refusal | null = null;

  /** All controls that can be pressed now. A user who scrolls moves them on purpose: that is no move. */
  look(now: ReadonlyMap<Control, Look>, now_ms: number, isScrolled = false): void {
    this.looks = new Map(
      [...now].map(([control, look]) => {
        const before = this.looks.get(control);
        const isSame = before?.meaning === look.meaning && before.enabled === look.enabled && (isScrolled || isNear(before, look, STILL_PX));
        return [control, { ...look, since_ms: isSame ? before.since_ms : now_ms }];
      }),
    );
  }

  /** Until when it ignores presses; 0: it does not. */
  deadUntil_ms(control: Control, now_ms: number): number {
    const look = this.looks.get(control);
    if (!look) return now_ms + SETTLE_MS; // not seen yet: it has just appeared
    const until_ms = look.since_ms + SETTLE_MS;
    return until_ms > now_ms ? until_ms : 0;
  }

  /** A press at a place. @param control  that starts or sets something; null: any other @returns whether it may act */
  press(at: Point, meaning: string, control: Control | null, now_ms: number): boolean {
    this.places = this.places.filter((place) => place.at_ms + PLACE_MS > now_ms);
    const place = this.places.find((each) => isNear(each, at, NEAR_PX));
    const isStranger = place !== undefined && place.meaning !== meaning;
    this.refusal = control === null ? null : isStranger ? "place" : this.deadUntil_ms(control, now_ms) > 0 ? "settling" : null;
    const acts = this.refusal === null;
    if (!place) this.places.push({ ...at, meaning, at_ms: now_ms });
    else Object.assign(place, { ...at, at_ms: now_ms, meaning: acts ? meaning : place.meaning });
    return acts;
  }
}

function isNear(a: Point, b: Point, px: number): boolean {
  return Math.abs(a.x - b.x) <= px && Math.abs(a.y - b.y) <= px;
}

// ---- in the page ----

/** Marked by Button's `machine`. */
const GUARDED = "[data-machine=starts], [data-machine=sets]";
const PRESSED = "button, a, input, select, textarea, summary, label";

function meaningOf(element: Element | null): string {
  if (!element) return "";
  return `${element.getAttribute("data-test") ?? ""} ${element.getAttribute("aria-label") ?? element.textContent}`;
}

function isEnabled(element: Element): boolean {
  return !(element as HTMLButtonElement).disabled;
}

/** What can be pressed: behind an open dialog nothing can. */
function visible(): Map<Element, Look> {
  const found = new Map<Element, Look>();
  const dialog = [...document.querySelectorAll("dialog[open]")].at(-1) ?? document;
  for (const element of dialog.querySelectorAll(GUARDED)) {
    const box = element.getBoundingClientRect();
    if (box.width > 0) found.set(element, { x: box.left, y: box.top, meaning: meaningOf(element), enabled: isEnabled(element) });
  }
  return found;
}

/** Watch this page's presses from now on. A control that is dead says so to readers (aria-disabled). */
export function guardPresses(): void {
  const guard = new PressGuard<Element>();
  let timer: ReturnType<typeof setTimeout> | undefined;
  let down: { element: Element | null; meaning: string; refusal: Refusal | null } | null = null;

  let scrolled = "";

  const look = (isInnerScroll = false): void => {
    const now_ms = performance.now();
    const controls = visible();
    const before = scrolled;
    scrolled = `${window.scrollX} ${window.scrollY}`; // its event may come after the press
    guard.look(controls, now_ms, isInnerScroll || scrolled !== before);
    const ends = [...controls.keys()].map((control) => {
      const until_ms = guard.deadUntil_ms(control, now_ms);
      if (until_ms > 0) control.setAttribute("aria-disabled", "true");
      else control.removeAttribute("aria-disabled");
      return until_ms;
    });
    clearTimeout(timer);
    const last_ms = Math.max(0, ...ends);
    if (last_ms > 0) timer = setTimeout(look, Math.min(...ends.filter((ms) => ms > 0)) - now_ms + 1);
  };

  const press = (event: MouseEvent, at: Point): boolean => {
    look();
    const element = (event.target as Element | null)?.closest?.(PRESSED) ?? null;
    const acts = guard.press(at, meaningOf(element), element?.matches(GUARDED) ? element : null, performance.now());
    down = { element, meaning: meaningOf(element), refusal: guard.refusal };
    return acts;
  };
  const refuse = (event: Event, element: Element | null, why: Refusal | null): void => {
    event.preventDefault();
    event.stopImmediatePropagation();
    if (element && why && isEnabled(element)) showIgnored(element, why, PLACE_MS / 1000);
  };

  const onPointerDown = (event: PointerEvent): void => {
    if (!press(event, { x: event.clientX, y: event.clientY })) refuse(event, down!.element, guard.refusal);
  };
  const onClick = (event: MouseEvent): void => {
    const element = (event.target as Element | null)?.closest?.(PRESSED) ?? null;
    if (!element?.matches(GUARDED)) return;
    const box = element.getBoundingClientRect();
    const isByKey = event.detail === 0;
    if (isByKey) press(event, { x: box.left + box.width / 2, y: box.top + box.height / 2 });
    const isSame = down?.element === element && down.meaning === meaningOf(element);
    const why = isSame ? down!.refusal : "settling";
    if (why) refuse(event, element, why);
  };
  /** A held key presses once. */
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.key !== "Enter" && event.key !== " ") return;
    const element = (event.target as Element | null)?.closest?.(event.key === "Enter" ? PRESSED : "button, summary");
    if (!element || element.matches("textarea")) return;
    const isDead = element.matches(GUARDED) && guard.deadUntil_ms(element, performance.now()) > 0;
    if (event.repeat || isDead) refuse(event, element, event.repeat ? null : "settling");
  };

  window.addEventListener("pointerdown", onPointerDown, true);
  window.addEventListener("click", onClick, true);
  window.addEventListener("keydown", onKeyDown, true);
  window.addEventListener("scroll", () => look(true), { capture: true, passive: true });
  window.addEventListener("resize", () => look());
  const changes = { subtree: true, childList: true, characterData: true, attributeFilter: ["class", "style", "open", "hidden", "disabled"] };
  new MutationObserver(() => look()).observe(document.body, changes);
  look();
}
