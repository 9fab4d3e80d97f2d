/** The spindle's warm-up against a controller whose reports are late. */
import { expect, it, vi } from "vitest";
import { WarmUp } from "../src/link/warmup";
import { connect, HANG, turn } from "./board";

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
