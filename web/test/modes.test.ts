/** What a sequence of the page leaves behind, against a controller whose every answer is given by hand. */
import { expect, it } from "vitest";
import { giveBack, modesOf } from "../src/link/modes";
import { MacroRun } from "../src/link/macrorun";
import { answerUntil, connect, turn } from "./board";

const AT = "MPos:0.000,0.000,0.000";
const BANNER = "Grbl 1.1h ['$' for help]";
const WORDS = "[GC:G0 G55 G17 G20 G91 G94 M5 M9 T0 F500 S0]";

it("brings work system, units, distance mode and tool length back behind the reset of a stop", async () => {
  const { board, controller } = await connect();
  board.says(WORDS, "[TLO:1.500]");
  const kept = modesOf(controller);
  expect(controller.stopMotion()).toBe(true);
  const back = giveBack(controller, kept, ["M5"]);
  await board.reports(`<Hold:1|${AT}>`);
  await board.reports(`<Hold:0|${AT}>`);
  expect(board.heard()).toBe("\x85!\x18");
  board.says(BANNER);
  const lines = await answerUntil(board, `<Idle|${AT}>`, "G0G55G20G91G94F500", (line) => (line === "$#" ? ["[TLO:0.000]", "ok"] : ["ok"]));
  await back;
  expect(lines.filter((line) => !line.startsWith("$")).slice(-3)).toEqual(["G21G43.1Z1.5", "M5", "G0G55G20G91G94F500"]);
  await controller.disconnect();
});

it("gives nothing into the hold of someone else, and all of it when that has ended", async () => {
  const { board, controller } = await connect();
  board.says(WORDS);
  await board.reports(`<Hold:0|${AT}>`);
  const back = giveBack(controller, modesOf(controller), ["M5"]);
  await board.reports(`<Hold:0|${AT}>`);
  await board.reports(`<Hold:0|${AT}>`);
  expect(board.heard()).toBe("");
  expect(await answerUntil(board, `<Idle|${AT}>`, "G0G55G20G91G94F500", () => ["ok"])).toContain("M5");
  await back;
  await controller.disconnect();
});

it("sends no line of a macro behind a reset that has ended its hold", async () => {
  const { board, controller } = await connect();
  const macro = new MacroRun(controller, (line) => controller.send(line).then(() => {}), () => false);
  const done = macro.run({ name: "m", lines: "G1X1F100\nG1X2" }).catch((error: unknown) => String(error));
  await turn();
  expect(board.heard()).toBe("G1X1F100\n");
  await board.reports(`<Hold:0|${AT}>`);
  board.says("ok");
  await turn();
  controller.reset();
  board.says(BANNER);
  await board.reports(`<Idle|${AT}>`);
  expect(await done).toContain("reset");
  expect(board.heard()).not.toContain("G1X2");
  await controller.disconnect();
});

it("stops a macro that waits in a tool change, and discards it", async () => {
  const { board, controller } = await connect();
  const macro = new MacroRun(controller, (line) => controller.send(line).then(() => {}), () => false);
  void macro.run({ name: "m", lines: "M6T2\nG1X2F100" }).catch(() => {});
  await turn();
  await board.reports(`<Tool|${AT}>`);
  macro.stop();
  await board.reports(`<Tool|${AT}>`);
  await board.reports(`<Tool|${AT}>`);
  expect(board.heard()).toBe("M6T2\n\x85!\x18");
  await controller.disconnect();
});

it("loses a line that is put while there is no link, and is in step with the next one", async () => {
  const { board, controller } = await connect();
  board.lose();
  expect(await controller.post("M5")).toEqual({ kind: "lost" });
  await connect(controller, board); // asks, and is answered
  const answer = controller.post("G4P0");
  board.says("error:33");
  expect(await answer).toMatchObject({ kind: "error", code: 33 });
  await controller.disconnect();
});
