import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Controller } from "../src/link/controller";
import { combined, heldFeed, Jogger } from "../src/link/jog";
import { connect, turn } from "./board";

/** What the page knows of a machine at rest that sends no report. */
const unreported = () => ({
  status: signal(null),
  state: signal("Idle"),
  operates: signal(false),
  settings: signal(new Map<number, string>()),
  machinePosition: signal([0, 0, 0]),
});

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
  const controller = { ...unreported(), stops: 0, post, realtime: (name: string) => void sent.push(name) };
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

describe("a stop by someone else, of a jog that is held", () => {
  /** A controller at 10 mm that has taken 4 mm of a jog of 600 mm/min, of which it has moved 2. */
  async function jogging(start = "<Idle|MPos:10.000,0.000,0.000>") {
    const { board, controller } = await connect();
    const told: string[] = [];
    const jogger = new Jogger(controller, (why) => told.push(why));
    board.says("[OPT:V,15,1025]", start); // room for all slices
    await turn();
    board.heard();
    jogger.begin({ X: 1 }, 600, "X+");
    const sends = async (): Promise<void> => {
      vi.advanceTimersByTime(50);
      await turn();
    };
    for (let n = 0; n < 2; n++) await sends();
    board.says("ok", "ok", "ok", "ok", "<Jog|MPos:12.000,0.000,0.000>");
    await turn();
    board.heard();
    return { board, controller, told, jogger, sends };
  }
  /** What is sent from now on, without questions. */
  async function after({ board, sends }: { board: { heard: () => string }; sends: () => Promise<void> }): Promise<string> {
    for (let n = 0; n < 20; n++) await sends();
    return board.heard();
  }

  test.each([
    ["it is held", "<Hold:1|MPos:12.200,0.000,0.000>"],
    ["the door is open", "<Door:2|MPos:12.200,0.000,0.000>"],
    ["it sleeps", "<Sleep|MPos:12.200,0.000,0.000>"],
  ])("ends it: %s", async (_, report) => {
    const all = await jogging();
    all.board.says(report);
    await turn();
    expect(all.told).toEqual([expect.stringMatching(/^Stopped by another client or at the machine$/)]);
    expect(all.jogger.isHeld("X+")).toBe(false);
    expect(await after(all)).not.toContain("$J=");
    all.board.says("<Idle|MPos:12.500,0.000,0.000>");
    expect(await after(all)).not.toContain("$J=");
    all.jogger.begin({ X: 1 }, 600, "X+"); // pressed again
    expect(await after(all)).toContain("$J=");
    all.jogger.end();
  });

  const TOLD = "[MSG:Another client or a button stopped the jog: release the key]";

  test.each([["the message", TOLD], ["the refusal of a slice", "error:184"], ["both", "error:184", TOLD]])("ends it, and is said once: %s", async (_, ...lines) => {
    const all = await jogging();
    for (let n = 0; n < 2; n++) await all.sends();
    expect(all.board.heard()).toContain("$J="); // the next slice
    all.board.says(...lines);
    await turn();
    expect(all.told).toEqual([expect.stringMatching(/^Stopped by another client or at the machine$/)]);
    expect(await after(all)).not.toContain("$J=");
  });

  describe("of a single step", () => {
    async function stepping() {
      const all = await jogging();
      all.jogger.end();
      for (let n = 0; n < 4; n++) all.board.says("ok"); // whatever of it is under way
      await turn();
      all.board.heard();
      const step = all.jogger.step({ X: 1 }, 100, 600);
      await turn();
      return { ...all, step };
    }

    test("is said, as the machine rests elsewhere", async () => {
      const { board, told, step } = await stepping();
      board.says("ok");
      await step;
      board.says("<Jog|MPos:12.000,0.000,0.000>", "<Idle|MPos:13.000,0.000,0.000>", TOLD);
      expect(told).toEqual([expect.stringMatching(/^Stopped by another client or at the machine$/)]);
    });

    test.each([["this page has stopped it", "HOLD"], ["this page has let go", "JOG_CANCEL"]] as const)("is not said where %s", async (_, name) => {
      const { board, controller, told, step } = await stepping();
      board.says("ok");
      await step;
      controller.realtime(name);
      board.says("<Idle|MPos:13.000,0.000,0.000>", TOLD); // of a jog of the pendant
      expect(told).toEqual([]);
    });

    test("is not said to who only views", async () => {
      const { board, told, step } = await stepping();
      board.says("ok");
      await step;
      board.says("[MSG:Observer: 192.168.1.7 is in control, $TAKE takes control]", TOLD);
      expect(told).toEqual([]);
    });

    test("a step that comes too soon after it is refused in the same words", async () => {
      const { board, told, step } = await stepping();
      board.says("error:184");
      await step;
      expect(told).toEqual([expect.stringMatching(/^Stopped by another client or at the machine$/)]);
    });
  });

  test.each([9, 8])("ends it: a slice is refused with error %s", async (code) => {
    const all = await jogging();
    for (let n = 0; n < 2; n++) await all.sends();
    expect(all.board.heard()).toContain("$J="); // the next slice
    all.board.says(`error:${code}`);
    await turn();
    expect(all.told).toEqual([expect.stringMatching(new RegExp(` error ${code},`))]);
    expect(await after(all)).not.toContain("$J=");
  });

  test("an alarm ends it, and has its own notice", async () => {
    const all = await jogging();
    all.board.says("ALARM:1");
    await turn();
    expect(all.told).toEqual([]);
    expect(await after(all)).not.toContain("$J=");
  });

  test("continues where the machine has moved all of it, while the link was slow", async () => {
    const all = await jogging();
    all.board.says("<Idle|MPos:14.000,0.000,0.000>");
    await turn();
    expect(all.told).toEqual([]);
    expect(await after(all)).toContain("$J=");
    all.jogger.end();
  });
});
