import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Controller } from "../src/link/controller";
import { Jogger } from "../src/link/jog";

/** What goes to the controller; each line is accepted. */
function listening(): { sent: string[]; jogger: Jogger } {
  const sent: string[] = [];
  const controller = {
    post: (text: string) => (sent.push(text), Promise.resolve({ kind: "ok", said: [] })),
    realtime: (name: string) => void sent.push(name),
  };
  return { sent, jogger: new Jogger(controller as unknown as Controller) };
}

beforeEach(() => void vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "performance"] }));
afterEach(() => void vi.useRealTimers());

test("held jogging is as long as the button is held, and little ahead", () => {
  const { sent, jogger } = listening();
  jogger.begin({ X: 1 }, 600);
  vi.advanceTimersByTime(2000);
  const millimetres = sent.length; // a slice of 0.1 s at 10 mm/s is 1 mm
  expect(millimetres).toBeGreaterThanOrEqual(20);
  expect(millimetres).toBeLessThanOrEqual(24);
  jogger.end();
  expect(sent.at(-1)).toBe("JOG_CANCEL");
});

test("a page that stood still does not send what it has missed", () => {
  const { sent, jogger } = listening();
  jogger.begin({ X: 1 }, 600);
  vi.advanceTimersByTime(1000);
  const before = sent.length;
  vi.spyOn(performance, "now").mockReturnValue(performance.now() + 10_000); // no timer ran meanwhile
  vi.advanceTimersByTime(50);
  expect(sent.length - before).toBeLessThanOrEqual(4);
});
