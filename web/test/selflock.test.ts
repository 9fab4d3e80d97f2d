/** A controller that keeps the machine stopped itself: neither an e-stop to release, nor a lock to open. */
import { expect, it } from "vitest";
import { connect, turn } from "./board";

const WHY = {
  "A firmware update is being written: wait until it ends": "A firmware update is being written: wait until it ends",
  "Locked by ALARM:57: a firmware update is being written: wait until it ends": "A firmware update is being written: wait until it ends",
  "Safe mode after crashes in a row: switch the controller off and on": "Safe mode after crashes in a row: switch the controller off and on",
  "Locked by ALARM:57: step pulses were lost: restart the controller": "Step pulses were lost: restart the controller",
};

it.each(Object.entries(WHY))("shows why: %s", async (said, shown) => {
  const { board, controller } = await connect();
  board.says("ALARM:57", `[MSG:${said}]`, "<Alarm|MPos:0.000,0.000,0.000>");
  await turn();
  expect([controller.selfLock.value, controller.needsReset.value]).toEqual([shown, false]);
  board.says("[MSG:Caution: something else]");
  await turn();
  expect(controller.selfLock.value).toBe(shown);
  board.says("[MSG:Reset to continue]");
  await turn();
  expect([controller.selfLock.value, controller.needsReset.value]).toEqual(["", true]);
  await controller.disconnect();
});

it.each([["Grbl 1.1h ['$' for help]"], ["<Idle|MPos:0.000,0.000,0.000>"]])("ends with %s", async (said) => {
  const { board, controller } = await connect();
  board.says("ALARM:57", "[MSG:A firmware update is being written: wait until it ends]", "<Alarm|MPos:0.000,0.000,0.000>");
  await turn();
  board.says(said);
  await turn();
  expect(controller.selfLock.value).toBe("");
  await controller.disconnect();
});

it("an e-stop that is pressed is another matter", async () => {
  const { board, controller } = await connect();
  board.says("ALARM:50", "[MSG:Release the emergency stop]", "<Alarm|MPos:0.000,0.000,0.000>");
  await turn();
  expect(controller.selfLock.value).toBe("");
  await controller.disconnect();
});
