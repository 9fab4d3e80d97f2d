/** What a link can do to a page: it freezes, is reset, the controller restarts, another client takes it, it is slow; in
 * mid-job, in a hold, in a probe. */
import { afterEach, expect, it, vi } from "vitest";
import { readProgram } from "../src/job/program";
import { JobRunner } from "../src/job/runner";
import { Controller } from "../src/link/controller";
import { Board, connect, turn } from "./board";

const [ONE, OTHER] = ["0000a1b2", "00ffee00"];
const PROGRAM = "G1X1F1000\nG1X2\nG1X3\nG1X4\nG1X5\nG1X6\nG1X7\n";
const WHERE = ["mid-job", "hold", "probe"] as const;
type Where = (typeof WHERE)[number];

interface Scene {
  board: Board;
  controller: Controller;
  job: JobRunner;
  probe: Promise<string> | null;
}

afterEach(() => vi.useRealTimers());

async function scene(where: Where, isSerial = false): Promise<Scene> {
  const controller = new Controller();
  const job = new JobRunner(controller);
  const { board } = await connect(controller, new Board(isSerial));
  board.says(`<Idle|MPos:0.000,0.000,0.000|WCO:0.000,0.000,0.000|Start:${ONE}>`);
  controller.homed.value = "XYZ";
  if (where === "probe") {
    const probe = controller.send("G38.2Z-10F50").then(() => "ok", (error: Error) => error.message);
    board.says("<Run|MPos:0.000,0.000,-1.000>");
    return { board, controller, job, probe };
  }
  job.load(readProgram("a.nc", PROGRAM));
  job.start();
  board.says("ok", "ok", "<Run|MPos:0.500,0.000,0.000|Ln:2>");
  await turn();
  if (where === "hold") board.says("<Hold:0|MPos:0.600,0.000,0.000|Ln:2>");
  board.heard();
  return { board, controller, job, probe: null };
}

async function outcome({ job, probe }: Scene): Promise<string> {
  return probe ? ((await probe) === "ok" ? "ok" : "void") : job.state.value;
}

it.each(WHERE)("frozen, %s: it says so after 3 s, sends nothing that is pressed, and gives the link up after 5 s", async (where) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const now = await scene(where);
  const { board, controller } = now;
  vi.advanceTimersByTime(2900);
  expect([controller.silent.value, controller.link.value]).toEqual([false, "open"]);
  vi.advanceTimersByTime(300);
  expect([controller.silent.value, controller.link.value]).toEqual([true, "open"]);
  board.heard();
  controller.realtime("HOLD");
  controller.reset();
  controller.realtime("RESUME");
  const line = controller.post("$J=G91X1F100");
  expect(board.heard()).toBe("");
  expect(controller.dropped.value).toEqual(["HOLD", "RESET", "RESUME"]);
  expect((await line).kind).toBe("lost");
  vi.advanceTimersByTime(2000);
  expect([controller.link.value, controller.silent.value]).toEqual(["lost", true]);
  expect(await outcome(now)).toBe(where === "probe" ? "void" : "lost");
});

it.each(["this page", "another client"])("homing by %s: the full report tells a busy controller from a dead link", async (by) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const controller = new Controller();
  const { board } = await connect(controller, new Board(false));
  board.says(`<Idle|MPos:0.000,0.000,0.000|WCO:0.000,0.000,0.000|Start:${ONE}>`);
  const homes = by === "this page" ? controller.send("$H").catch(() => {}) : null;
  for (let second = 0; second < 20; second++) {
    const before = board.askedFully;
    vi.advanceTimersByTime(1000);
    if (board.askedFully > before) board.says("<Home|MPos:0.000,0.000,0.000>"); // `?` alone is not answered
    expect([controller.silent.value, controller.link.value]).toEqual([false, "open"]);
  }
  expect(controller.state.value).toBe("Home");
  vi.advanceTimersByTime(3200); // and then nothing more
  expect([controller.silent.value, controller.link.value]).toEqual([true, "open"]);
  vi.advanceTimersByTime(2000);
  expect(controller.link.value).toBe("lost");
  await homes;
});

it.each(WHERE)("frozen, %s: what is pressed once more, and sent, is not named as not sent any more", async (where) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller } = await scene(where);
  vi.advanceTimersByTime(3200);
  controller.realtime("HOLD");
  controller.realtime("SPINDLE_STOP");
  board.says("<Hold:0|MPos:0.700,0.000,0.000>");
  board.heard();
  controller.realtime("HOLD");
  expect([board.heard(), controller.dropped.value]).toEqual(["!", ["SPINDLE_STOP"]]);
  await controller.disconnect();
});

const BANNER = "Grbl 1.1h ['$' for help]";

it.each([1, 2, 3])("Reset pressed %i times, before the first answer: no one else has reset it", async (presses) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller } = await connect();
  for (let n = 0; n < presses; n++) controller.reset();
  for (let n = 0; n < presses; n++) {
    board.says(BANNER);
    vi.advanceTimersByTime(200);
  }
  expect(controller.restarted.value).toBe(false);
  vi.advanceTimersByTime(5000);
  board.says(BANNER);
  expect(controller.restarted.value).toBe(true);
  await controller.disconnect();
});

it.each(WHERE)("frozen, %s: what ends a jog goes all the same, so that no jog outlives the hand that held it", async (where) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller } = await scene(where);
  vi.advanceTimersByTime(3200);
  board.heard();
  controller.realtime("JOG_CANCEL");
  expect([board.heard(), controller.dropped.value]).toEqual(["\x85", []]);
  await controller.disconnect();
});

it.each(["mid-job", "hold"] as const)("frozen, %s: a Stop that was not sent does not count as stopped", async (where) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller, job } = await scene(where);
  vi.advanceTimersByTime(3200);
  job.stop();
  expect([job.state.value, job.why.value, controller.dropped.value]).toEqual(["running", "", ["HOLD"]]);
  board.says("<Run|MPos:0.700,0.000,0.000|Ln:2>");
  board.heard();
  job.stop();
  expect([job.state.value, board.heard()]).toEqual(["stopping", "!"]);
  await controller.disconnect();
});

it("frozen: a cycle's stop says whether it was sent", async () => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller } = await scene("probe");
  const before = controller.stops;
  vi.advanceTimersByTime(3200);
  expect([controller.stopMotion(), controller.stops > before]).toEqual([false, true]);
  board.says("<Run|MPos:0.000,0.000,-2.000>");
  expect(controller.stopMotion()).toBe(true);
  await controller.disconnect();
});

it.each(["HOLD", "RESET", "JOG_CANCEL"] as const)("%s takes the jogs that were not sent, and counts as a stop", async (name) => {
  const { board, controller } = await connect(new Controller(), new Board(false));
  board.heard();
  const jogs = Array.from({ length: 10 }, () => controller.post("$J=G91G21X1.6667F1000", false)); // more than fit
  const sent = board.heard().split("\n").length - 1;
  expect(sent).toBeLessThan(10);
  const before = controller.stops;
  controller.realtime(name);
  expect(controller.stops).toBe(before + 1);
  expect(await Promise.all(jogs.slice(sent))).toEqual(Array(10 - sent).fill({ kind: "lost" }));
  await controller.disconnect();
});

it.each(WHERE)("slow, %s: what comes after 2.9 s each time keeps the link, and presses go", async (where) => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const now = await scene(where);
  for (let n = 0; n < 4; n++) {
    vi.advanceTimersByTime(2900);
    now.board.says("<Run|MPos:0.700,0.000,0.000|Ln:2>");
  }
  now.board.heard();
  now.controller.realtime("HOLD");
  expect([now.board.heard(), now.controller.link.value, now.controller.dropped.value]).toEqual(["!", "open", []]);
  await now.controller.disconnect();
});

it("a tab in the background, which asks rarely, keeps its link", async () => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { board, controller } = await scene("mid-job");
  vi.advanceTimersByTime(200);
  board.says("<Run|MPos:0.700,0.000,0.000|Ln:2>");
  Object.assign(controller, { heardAt: performance.now() - 60_000, waitsSince: performance.now() - 60_000, askedAt: performance.now() - 60_000 });
  vi.advanceTimersByTime(100);
  expect([controller.silent.value, controller.link.value]).toEqual([false, "open"]);
  await controller.disconnect();
});

it("a serial port that is silent is kept: the board may be busy", async () => {
  vi.useFakeTimers({ toFake: ["performance", "setInterval", "clearInterval"] });
  const { controller } = await scene("mid-job", true);
  vi.advanceTimersByTime(20_000);
  expect([controller.silent.value, controller.link.value]).toEqual([true, "open"]);
  await controller.disconnect();
});

it.each(WHERE)("reset by another, %s: the job ends, and the position is still known", async (where) => {
  const now = await scene(where);
  now.board.says("Grbl 1.1h ['$' for help]", `<Idle|MPos:0.600,0.000,0.000|Start:${ONE}>`);
  await turn();
  expect(await outcome(now)).toBe(where === "probe" ? "void" : "failed");
  expect([now.controller.positionLost.value, now.controller.restarted.value]).toEqual([false, true]);
  await now.controller.disconnect();
});

it.each(WHERE)("restarted, %s: the position is lost, and nothing can be resumed", async (where) => {
  const now = await scene(where);
  now.board.says("Grbl 1.1h ['$' for help]", `<Idle|MPos:0.000,0.000,0.000|Start:${OTHER}>`);
  await turn();
  expect(await outcome(now)).toBe(where === "probe" ? "void" : "restarted");
  expect([now.controller.positionLost.value, now.controller.homed.value]).toEqual([true, ""]);
  await now.controller.disconnect();
});

it.each(WHERE)("restarted while the link was lost, %s", async (where) => {
  const now = await scene(where);
  now.board.lose();
  expect(await outcome(now)).toBe(where === "probe" ? "void" : "lost");
  const again = now.controller.connect(new Board(false));
  await turn();
  (now.controller as unknown as { transport: Board }).transport.says(`<Idle|MPos:0.000,0.000,0.000|Start:${OTHER}>`);
  expect(now.controller.positionLost.value).toBe(true);
  expect(now.job.state.value).toBe(where === "probe" ? "none" : "restarted");
  await now.controller.disconnect();
  await again.catch(() => {});
});

it("a start that is named by $I counts as well, and homing ends the loss", async () => {
  const { controller, board } = await scene("probe");
  board.says("ok", `[START:${OTHER}]`);
  expect(controller.positionLost.value).toBe(true);
  const homing = controller.send("$H");
  board.says("ok");
  await turn();
  board.says("ok", "ok", "ok", "ok");
  await Promise.race([homing.catch(() => {}), turn()]);
  expect(controller.positionLost.value).toBe(false);
  await controller.disconnect();
});

it.each(["homing", "a new zero", "nothing"])("a lost position is lost after a reload, too, until it is found: by %s", async (by) => {
  let kept = "";
  const memory = { load: () => kept, save: (text: string) => void (kept = text) };
  const { controller, board } = await scene("probe");
  controller.memory = memory;
  board.says("Grbl 1.1h ['$' for help]", `<Idle|MPos:0.000,0.000,0.000|Start:${OTHER}>`);
  expect(controller.positionLost.value).toBe(true);
  board.says("ok", "ok", "ok", "ok");
  await turn();
  if (by === "a new zero") controller.findPosition();
  if (by === "homing") {
    void controller.send("$H").catch(() => {});
    for (let n = 0; n < 6; n++) (board.says("ok"), await turn());
  }
  expect(controller.positionLost.value).toBe(by === "nothing");
  await controller.disconnect();
  for (const start of [OTHER, ONE]) {
    const after = new Controller();
    after.memory = memory;
    after.expectStart(start); // of a kept job
    const again = new Board(false);
    const open = after.connect(again);
    await turn();
    again.says(`<Idle|MPos:0.000,0.000,0.000|Start:${start}>`);
    expect(after.positionLost.value).toBe(by === "nothing" && start === OTHER);
    await after.disconnect();
    await open.catch(() => {});
  }
});

it("a job that was kept over a reload was sent to another start", async () => {
  const { controller, board } = await scene("hold");
  controller.expectStart(ONE);
  expect(controller.positionLost.value).toBe(false);
  controller.expectStart(OTHER);
  expect(controller.positionLost.value).toBe(true);
  board.lose();
});

it.each(WHERE)("taken, %s: it says by whom, and what was under way is over", async (where) => {
  const now = await scene(where);
  now.board.says("[MSG:10.0.0.7:4711 commands]", "[MSG:Observer: 10.0.0.7:4711 is in control, $TAKE takes control]");
  await turn();
  expect([now.controller.role.value, now.controller.takenBy.value]).toEqual(["observer", "10.0.0.7:4711"]);
  expect(await outcome(now)).toBe(where === "probe" ? "void" : "taken");
  if (where !== "probe") expect(now.job.why.value).toBe("10.0.0.7:4711 took control; line 2 was being executed");
  now.board.heard();
  now.controller.realtime("HOLD");
  expect(now.board.heard()).toBe("!");
  await now.controller.disconnect();
});

it.each(["Run", "Hold:0", "Jog", "Home", "Tool", "Door:1", "Alarm", "Idle"])("takes control by the message, not by the ok, of a machine in %s", async (state) => {
  const { board, controller } = await connect(new Controller(), new Board(false));
  board.says("[MSG:Observer: 10.0.0.7:4711 is in control, $TAKE takes control]", `<${state}|MPos:0.000,0.000,0.000>`);
  await turn();
  board.heard();
  const taken = controller.send("$TAKE");
  expect([board.heard(), controller.commands.value]).toEqual(["$TAKE\n", false]);
  board.says("[MSG:In control]");
  expect(controller.commands.value).toBe(true);
  await controller.disconnect();
  await taken.catch(() => {});
});

const SETTINGS = ["$100=80.000", "$132=200.000"];

it("knows settings and offsets after a reload in a hold, of the same start only", async () => {
  let kept = "";
  const memory = { load: () => kept, save: (text: string) => void (kept = text) };
  const before = new Controller();
  before.memory = memory;
  const { board } = await connect(before, new Board(false));
  board.says(`<Idle|MPos:0.000,0.000,0.000|Start:${ONE}>`);
  const asked = before.refresh("$$", "$#");
  board.says(...SETTINGS, "ok");
  await turn();
  board.says("[G54:1.000,2.000,3.000]", "ok");
  await asked;
  await before.disconnect();
  for (const [start, settings, offset] of [[OTHER, 0, undefined], [ONE, 2, "1.000,2.000,3.000"]] as const) {
    const after = new Controller();
    after.memory = memory;
    const again = new Board(false);
    const open = after.connect(again);
    await turn();
    again.says(`<Hold:0|MPos:0.000,0.000,0.000|Start:${start}>`);
    expect([after.settings.value.size, after.offsets.value.get("G54")]).toEqual([settings, offset]);
    await after.disconnect();
    await open.catch(() => {});
  }
});

it.each(["", "nonsense", "{}", '{"start":"0000a1b2","said":{"$$":7}}'])("passes over a damaged memory: %s", async (text) => {
  const controller = new Controller();
  controller.memory = { load: () => text, save: () => {} };
  const { board } = await connect(controller, new Board(false));
  board.says(`<Hold:0|MPos:0.000,0.000,0.000|Start:${ONE}>`);
  expect(controller.settings.value.size).toBe(0);
  await controller.disconnect();
});

it("a parked hold that someone else resumes ends what waits for rest in it", async () => {
  const { board, controller } = await scene("hold");
  board.says("[MSG:Parked: jog, probe, set zero; ~ returns to the job]");
  board.says("<Hold:0|MPos:0.600,0.000,0.000|Ln:2>");
  expect(controller.operates.value).toBe(true);
  const rest = controller.rest().then(() => "rests", (error: Error) => error.message);
  board.says("<Run|MPos:0.700,0.000,0.000|Ln:2>");
  await turn();
  board.says("<Idle|MPos:7.000,0.000,0.000>", "<Idle|MPos:7.000,0.000,0.000>");
  await turn();
  expect(await rest).toContain("resumed at the machine or by another client");
});

it("says that the tool of a change was not measured, until the change ends", async () => {
  const { board, controller } = await scene("hold");
  board.says("<Tool|MPos:0.600,0.000,0.000>", "[MSG:Tool change: T2]", "[MSG:Tool not measured: no contact within $342]");
  expect(controller.notMeasured.value).toBe("Tool not measured: no contact within $342");
  board.says("<Hold:0|MPos:0.600,0.000,0.000>"); // on its way to the setter again
  expect(controller.notMeasured.value).not.toBe("");
  board.says("[MSG:Tool length: 3.200]");
  expect(controller.notMeasured.value).toBe("");
  board.says("[MSG:Tool not measured: stopped]", "<Run|MPos:0.600,0.000,0.000>");
  expect(controller.notMeasured.value).toBe("");
});
