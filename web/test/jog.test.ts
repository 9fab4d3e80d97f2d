import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Controller } from "../src/link/controller";
import { combined, heldFeed, Jogger } from "../src/link/jog";

/** A machine that takes each jog up to the end of its travel. */
function listening(travel_mm = Infinity, refusal = 15) {
  const sent: string[] = [];
  const told: string[] = [];
  const at: Record<string, number> = {};
  const post = (text: string): Promise<object> => {
    sent.push(text);
    const words = [...text.matchAll(/([XYZ])(-?[\d.]+)/g)].map(([, axis, value]) => [axis!, (at[axis!] ?? 0) + Number(value)] as const);
    if (words.some(([, mm]) => Math.abs(mm) > travel_mm)) return Promise.resolve({ kind: "error", code: refusal, said: [] });
    Object.assign(at, Object.fromEntries(words));
    return Promise.resolve({ kind: "ok", said: [] });
  };
  const controller = { stops: 0, post, realtime: (name: string) => void sent.push(name) };
  return { sent, told, at, controller, jogger: new Jogger(controller as unknown as Controller, (why) => told.push(why)) };
}

beforeEach(() => void vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "performance"] }));
afterEach(() => void vi.useRealTimers());

test("held jogging is as long as the button is held, and little ahead", async () => {
  const { sent, jogger } = listening();
  jogger.begin({ X: 1 }, 600, "X+");
  await vi.advanceTimersByTimeAsync(2000);
  const millimetres = sent.length; // a slice of 0.1 s at 10 mm/s is 1 mm
  expect(millimetres).toBeGreaterThanOrEqual(20);
  expect(millimetres).toBeLessThanOrEqual(24);
  jogger.end();
  expect(sent.at(-1)).toBe("JOG_CANCEL");
});

test("a page that stood still does not send what it has missed", () => {
  const { sent, jogger } = listening();
  jogger.begin({ X: 1 }, 600, "X+");
  vi.advanceTimersByTime(1000);
  const before = sent.length;
  vi.spyOn(performance, "now").mockReturnValue(performance.now() + 10_000); // no timer ran meanwhile
  vi.advanceTimersByTime(50);
  expect(sent.length - before).toBeLessThanOrEqual(4);
});

test.each(["X+", "keys"])("a stop of this page ends a held jog, which begins again with a new press only: %s", (by) => {
  const { sent, controller, jogger } = listening();
  jogger.begin({ X: 1 }, 600, by);
  vi.advanceTimersByTime(500);
  sent.length = 0;
  controller.stops++; // Hold, Reset or Escape, while the finger is still down
  expect(jogger.isHeld(by)).toBe(false);
  vi.advanceTimersByTime(2000);
  expect(sent).toEqual(["JOG_CANCEL"]);
  jogger.begin({ X: 1 }, 600, by);
  expect(sent.length).toBeGreaterThan(1);
});

test("a link that does not answer gets little, and the jog ends and says so", () => {
  const { sent, told, controller, jogger } = listening();
  controller.post = (text: string) => (sent.push(text), new Promise(() => {}));
  jogger.begin({ X: 1 }, 6000, "X+");
  vi.advanceTimersByTime(5000);
  expect(sent.at(-1)).toBe("JOG_CANCEL");
  expect(sent.length - 1).toBeLessThanOrEqual(6); // 0.6 s of motion, whenever it arrives
  expect(told).toHaveLength(1);
});

test.each([50, 200, 400])("a slow link, with answers after %s ms, jogs on", async (delay_ms) => {
  const { sent, told, controller, jogger } = listening();
  controller.post = (text: string) => {
    sent.push(text);
    let end = (): void => {};
    const timer = setInterval(() => (clearInterval(timer), end()), delay_ms);
    return new Promise((resolve) => (end = () => resolve({ kind: "ok", said: [] })));
  };
  jogger.begin({ X: 1 }, 600, "X+");
  for (let n = 0; n < 40; n++) await vi.advanceTimersByTimeAsync(50);
  expect(told).toEqual([]);
  expect(sent.length).toBeGreaterThanOrEqual(20);
  jogger.end();
});

test.each([["X+", "Y+"], ["X+", "X−"]])("what was let go does not end the next one: %s, then %s", async (first, second) => {
  const { sent, jogger } = listening();
  jogger.begin({ X: 1 }, 600, first!);
  jogger.end(first); // the pointer is up
  sent.length = 0;
  jogger.begin({ Y: 1 }, 600, second!);
  jogger.end(first); // its button loses the focus
  expect(sent).not.toContain("JOG_CANCEL");
  await vi.advanceTimersByTimeAsync(500);
  expect(sent.length).toBeGreaterThanOrEqual(7);
  jogger.end(second);
  expect(sent.at(-1)).toBe("JOG_CANCEL");
});

describe("the end of the travel", () => {
  test.each([0, 0.004, 0.02, 0.7, 1.4, 4.9, 5, 12.345])("is reached when it is %s mm away, and said once", async (travel_mm) => {
    const { sent, told, at, jogger } = listening(travel_mm);
    jogger.begin({ X: 1 }, 3000, "X+"); // slices of 5 mm
    for (let n = 0; n < 40; n++) await vi.advanceTimersByTimeAsync(50);
    expect(travel_mm - (at.X ?? 0)).toBeGreaterThanOrEqual(0);
    expect(travel_mm - (at.X ?? 0)).toBeLessThanOrEqual(0.01);
    expect(told).toEqual(["End of the travel: X+"]);
    expect(sent).not.toContain("JOG_CANCEL"); // which would take away what was accepted
    jogger.end("X+");
    expect(sent.at(-1)).toBe("JOG_CANCEL");
  });

  test("ends with the hand, in the middle of it", async () => {
    const { sent, told, jogger } = listening(1.4);
    jogger.begin({ X: 1 }, 3000, "X+");
    await Promise.resolve();
    jogger.end("X+");
    const count = sent.length;
    for (let n = 0; n < 10; n++) await vi.advanceTimersByTimeAsync(50);
    expect(sent.length).toBe(count);
    expect(told).toEqual([]);
  });

  test("another refusal ends the jog and is said once", async () => {
    const { sent, told, jogger } = listening(0, 9);
    jogger.begin({ X: 1 }, 3000, "X+");
    for (let n = 0; n < 10; n++) await vi.advanceTimersByTimeAsync(50);
    expect(told).toHaveLength(1);
    expect(told[0]).toContain("error 9");
    expect(sent.filter((text) => text === "JOG_CANCEL")).toHaveLength(1);
  });
});

test("two keys jog diagonally at the feed, and opposed ones stand still", () => {
  expect(combined([{ X: 1 }, { Y: -1 }])).toEqual({ X: 1, Y: -1 });
  expect(combined([{ X: 1 }, { X: -1 }, { Y: 1 }])).toEqual({ Y: 1 });
  const { sent, jogger } = listening();
  jogger.begin({ X: 1, Y: -1 }, 600, "keys");
  expect(sent[0]).toBe("$J=G91G21X0.7071Y-0.7071F600"); // 1 mm of path in 0.1 s
  jogger.end();
});

test("no axis is asked for more than its fastest feed", () => {
  const settings = new Map([[110, "6000"], [112, "500"]]);
  expect(heldFeed({ X: 1 }, 3000, settings)).toBe(3000);
  expect(heldFeed({ X: 1, Z: 1 }, 3000, settings)).toBe(500);
  expect(heldFeed({ Y: 1 }, 3000, settings)).toBe(3000); // not known
});
