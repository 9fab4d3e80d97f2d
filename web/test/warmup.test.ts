/** The spindle's warm-up against a controller whose reports are late. */
import { expect, it, vi } from "vitest";
import { WarmUp } from "../src/link/warmup";
import { answerUntil, connect, HANG, turn } from "./board";

it("stops the spindle behind a stage that is shorter than the time to the next report", async () => {
  const { board, controller } = await connect();
  const warm = new WarmUp(controller, () => {});
  void warm.run([{ rpm: 600, time_s: 0.001 }]);
  await board.reports("<Run|MPos:0.000,0.000,0.000>"); // it runs up
  expect(board.heard()).toBe("M3S600\n");
  board.says("ok");
  await vi.waitFor(() => expect(board.heard()).toContain("M5\n"), HANG);
  await controller.disconnect();
});

it("stops a spindle that runs up, though the last report does not know it", async () => {
  const { board, controller } = await connect();
  const warm = new WarmUp(controller, () => {});
  void warm.run([{ rpm: 600, time_s: 60 }]);
  warm.stop();
  expect(board.heard()).toBe("M3S600\n\x85!");
  await board.reports("<Hold:0|MPos:0.000,0.000,0.000>");
  await board.reports("<Hold:0|MPos:0.000,0.000,0.000>");
  expect(board.heard()).toBe("\x18");
  await controller.disconnect();
  await turn();
});

it("says so when M5 is not accepted, and sends it behind a stage that was refused", async () => {
  const { board, controller } = await connect();
  const told: [number, string][] = [];
  const warm = new WarmUp(controller, (stage, why) => told.push([stage, why]));
  const done = warm.run([{ rpm: 600, time_s: 0.001 }, { rpm: 900, time_s: 60 }]);
  const isTaken = (line: string): boolean => line.startsWith("$") || line === "M3S600"; // then a pendant has control
  await answerUntil(board, "<Idle|MPos:0.000,0.000,0.000>", "M5", (line) => (isTaken(line) ? ["ok"] : ["error:9"]));
  await done;
  expect(told.at(-1)).toEqual([-1, expect.stringContaining("may still be turning")]);
  await controller.disconnect();
});

it("discards the spindle at a door: the Resume behind it starts nothing", async () => {
  const { board, controller } = await connect();
  const warm = new WarmUp(controller, () => {});
  void warm.run([{ rpm: 600, time_s: 60 }]);
  board.says("ok");
  await turn();
  await board.reports("<Door:1|MPos:0.000,0.000,0.000>");
  warm.stop();
  await board.reports("<Door:1|MPos:0.000,0.000,0.000>");
  await board.reports("<Door:1|MPos:0.000,0.000,0.000>");
  expect(board.heard()).toBe("M3S600\n\x85!\x18");
  await controller.disconnect();
});
