/** The laser's test against a controller whose answers are late. */
import { expect, it } from "vitest";
import { Beam } from "../src/link/beam";
import { connect, turn } from "./board";

const FIRE = "G94G1F100M3S10";
const WORDS = "G0 G54 G17 G21 G90 G94 M5 M9 T0 F777 S50";

it("gives back the words of the program, also of a beam right behind another one", async () => {
  const { board, controller } = await connect();
  controller.modes.value = WORDS;
  const beam = new Beam(controller, () => {});
  void beam.light(FIRE, 60);
  await turn();
  expect(board.heard()).toBe(`${FIRE}\n`);
  beam.end();
  void beam.light(FIRE, 60); // before anything is answered
  await turn();
  expect(board.heard()).toBe("M5\nG0G94S50F777\n"); // in one go, and dark before the next one
  board.says("ok", "ok", "ok");
  await turn();
  expect(board.heard()).toMatch(/^(\$G\n)+$/); // what was known is of the beam
  board.says(`[GC:${WORDS}]`, "ok");
  await turn();
  expect(board.heard().replace("$G\n", "")).toBe(`${FIRE}\n`);
  beam.end();
  expect(board.heard()).toBe("M5\nG0G94S50F777\n");
  await controller.disconnect();
});

it("does not light for a press that has ended before its turn", async () => {
  const { board, controller } = await connect();
  const beam = new Beam(controller, () => {});
  void controller.post("F5");
  void beam.light(FIRE, 60);
  await turn();
  beam.end();
  expect(board.heard()).toBe("F5\n$G\n");
  board.says("ok", `[GC:${WORDS}]`, "ok");
  await turn();
  expect(board.heard()).not.toContain("M3");
  await controller.disconnect();
});
