/** Presses at one place: which of them may reach the machine. */
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { PLACE_MS, PressGuard, SETTLE_MS, type Look } from "../src/press";

const AT = { x: 100, y: 100 };
const AGAIN_S = [0.2, 0.6, 2];

/** Controls by name, each at a place and enabled. */
class Page {
  readonly guard = new PressGuard<object>();
  readonly controls = new Map<object, Look>();
  now_ms = 10_000;

  show(meaning: string, at = AT): object {
    const control = {};
    this.controls.set(control, { ...at, meaning, enabled: true });
    this.look();
    return control;
  }
  change(control: object, part: Partial<Look>): void {
    this.controls.set(control, { ...this.controls.get(control)!, ...part });
    this.look();
  }
  look(isScrolled = false): void {
    this.guard.look(this.controls, this.now_ms, isScrolled);
  }
  /** @param control  null: one that stops, or none */
  press(control: object | null, meaning = this.controls.get(control!)?.meaning ?? "", at = AT): boolean {
    return this.guard.press(at, meaning, control, this.now_ms);
  }
  wait(s: number): void {
    this.now_ms += 1000 * s;
  }
}

describe("a control that starts something", () => {
  it.each(AGAIN_S)("is not started by a second press of what stopped it, %s s later", (s) => {
    const page = new Page();
    expect(page.press(null, "stop")).toBe(true);
    const start = page.show("start");
    for (let n = 0; n < 5; n++) {
      page.wait(s);
      expect(page.press(start), `press ${n + 2}`).toBe(false);
    }
    page.wait(PLACE_MS / 1000);
    expect(page.press(start)).toBe(true);
  });

  it.each(AGAIN_S)("does not inherit the press of another one that was there, %s s later", (s) => {
    const page = new Page();
    const [up, left] = [page.show("Z+"), page.show("Y+", { x: 100, y: 60 })];
    page.wait(1);
    expect(page.press(up)).toBe(true);
    page.change(up, { y: 140 }); // a notice of two rows
    page.change(left, { y: 100 });
    page.wait(s);
    expect(page.press(left)).toBe(false);
  });

  it("says why a press did not act", () => {
    const page = new Page();
    const start = page.show("start");
    page.press(start);
    expect(page.guard.refusal).toBe("settling");
    page.wait(PLACE_MS / 1000);
    page.press(start);
    expect(page.guard.refusal).toBeNull();
    page.press(null, "stop");
    expect(page.guard.refusal).toBeNull();
    page.wait(0.6);
    page.press(start);
    expect(page.guard.refusal).toBe("place");
  });

  it("acts again and again, as the same one", () => {
    const page = new Page();
    const up = page.show("Z+");
    page.wait(1);
    for (let n = 0; n < 8; n++, page.wait(0.1)) expect(page.press(up)).toBe(true);
  });

  it("is dead until it has been in its place for a while", () => {
    const page = new Page();
    const up = page.show("Z+");
    const dead = (): boolean => page.guard.deadUntil_ms(up, page.now_ms) > 0;
    const settles = (): void => {
      expect(dead()).toBe(true);
      page.wait(SETTLE_MS / 1000 - 0.01);
      expect(dead()).toBe(true);
      page.wait(0.01);
      expect(dead()).toBe(false);
    };
    settles(); // it appeared
    page.change(up, { y: 140 });
    settles();
    page.change(up, { meaning: "Y+" });
    settles();
    page.change(up, { enabled: false });
    page.wait(5);
    page.change(up, { enabled: true });
    settles();
    page.controls.delete(up); // behind a dialog
    page.look();
    page.controls.set(up, { ...AT, meaning: "Y+", enabled: true });
    page.look();
    settles();
  });

  it("is not moved by the pixel of a pressed button, nor by a user who scrolls", () => {
    const page = new Page();
    const up = page.show("Z+");
    page.wait(1);
    page.change(up, { y: 101 });
    expect(page.guard.deadUntil_ms(up, page.now_ms)).toBe(0);
    page.controls.set(up, { ...page.controls.get(up)!, y: 40 });
    page.look(true);
    expect(page.guard.deadUntil_ms(up, page.now_ms)).toBe(0);
  });

  it("is not kept by a press elsewhere", () => {
    const page = new Page();
    const up = page.show("Z+");
    page.wait(1);
    page.press(null, "stop", { x: 100, y: 160 });
    page.wait(0.2);
    expect(page.press(up)).toBe(true);
  });

  it("is not started by the third press of start, stop, start at one place", () => {
    const page = new Page();
    const start = page.show("start");
    page.wait(1);
    expect(page.press(start)).toBe(true);
    page.wait(0.6);
    expect(page.press(null, "stop")).toBe(true);
    page.wait(0.6);
    expect(page.press(start)).toBe(false);
  });
});

/** Notices come and go at one place, and a guide's steps at another: what is pressed twice there must not do a second thing. */
describe("what sets something says so to the guard", () => {
  const source = ["header", "guide", "hold", "inout"].map((name) => readFileSync(new URL(`../src/view/${name}.tsx`, import.meta.url), "utf8")).join("\n");
  const tags = [...source.matchAll(/<Button\b(?:[^>]|=>)*?testId=(?:"([^"]+)"|\{`([^`]+)`\})/g)].map(([tag, plain, pattern]) => [plain ?? pattern!, tag] as const);

  it.each(["zero-is-new", "take", "take-anyway", "unlock", "park", "guide-apply", "guide-invert", "guide-flip-${axis}", "guide-correct-${axis}", "output-on-${i}"])("%s", (id) => {
    const found = tags.filter(([name]) => name === id).map(([, tag]) => tag.slice(tag.lastIndexOf("<Button")));
    expect(found).toHaveLength(1);
    expect(found[0]).toMatch(/machine="(?:sets|starts)"/);
  });
});
