/** What a reset and the end of a program take from a job that is to run again. */
import { existsSync, readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { beganOf, discarded, namesSystem, otherSystem, UNKNOWN, type Began } from "../src/job/began";
import { Core } from "../src/job/core";
import { readProgram } from "../src/job/program";
import { planResume, type MachineFacts } from "../src/job/resume";
import { JobRunner } from "../src/job/runner";
import { Controller } from "../src/link/controller";
import { connect, turn } from "./board";

const RESET: Began = { modes: "G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0", length: "0.000", shift: "0.000,0.000,0.000" };
const RAN: Began = { modes: "G0 G55 G17 G21 G90 G94 M5 M9 T0 F0 S0", length: "3.200", shift: "0.000,5.000,0.000" };

it("names another work system, and what is gone, and nothing of what has stayed or is not known", () => {
  expect(otherSystem(RAN, RESET)).toEqual({ then: "G55", now: "G54" });
  expect(discarded(RAN, RESET)).toEqual([expect.stringContaining("(3.200)"), expect.stringContaining("G92")]);
  expect([otherSystem(RAN, RAN), discarded(RAN, RAN), discarded(RESET, RAN)]).toEqual([null, [], []]);
  expect([otherSystem(UNKNOWN, RESET), otherSystem(RAN, UNKNOWN), discarded(UNKNOWN, RESET)]).toEqual([null, null, []]);
});

it.each([
  ["G21G90G54\nG0X1\n", true],
  ["G21G90\nG59.1G0X1\n", true],
  ["G21G90\nG0X1\nG55\n", false],
  ["G21G90\nM3S1000\n", false],
])("whether %j names its work system before it moves: %s", (source, does) => {
  expect(namesSystem(readProgram("a.nc", source).lines)).toBe(does);
});

it("reads what a browser has kept, whatever it is", () => {
  expect(beganOf(RAN)).toEqual(RAN);
  for (const kept of [undefined, null, 3, { modes: 3 }]) expect(beganOf(kept)).toEqual(UNKNOWN);
});

it("a job has what was in force at its start, and the tool length that was measured while it was parked", async () => {
  const controller = new Controller();
  const job = new JobRunner(controller);
  const { board } = await connect(controller);
  board.says("[GC:G0 G55 G17 G21 G90 G94 M5 M9 T0 F0 S0]", "[TLO:0.000]", "[G92:0.000,0.000,0.000]");
  job.load(readProgram("a.nc", "G1X1F600\nG1X2\n"));
  job.start();
  board.says("ok", "ok", "<Hold:0|MPos:0.500,0.000,0.000>");
  board.says("[GC:G0 G56 G17 G21 G91 G94 M5 M9 T0 F0 S0]", "[TLO:3.200]", "<Hold:0|MPos:0.500,0.000,0.000>");
  await turn();
  controller.reset();
  board.says("Grbl 1.1h ['$' for help]", "[TLO:0.000]", "<Idle|MPos:0.500,0.000,0.000>");
  await turn();
  expect(job.ended.value).toBe(true);
  expect([job.began.value.modes.slice(3, 6), job.began.value.length, job.standsIn().length]).toEqual(["G55", "3.200", "0.000"]);
  await controller.disconnect();
});

const wasm = new URL("../../build/wasm/core.wasm", import.meta.url);

describe.skipIf(!existsSync(wasm))("a resume", () => {
  const system = async (source: string, modes?: string): Promise<string> => {
    const core = await Core.load(readFileSync(wasm));
    const offsets = { G54: [0, 0, 0], G55: [50, 0, 0], G92: [0, 0, 0], TLO: [0] };
    const facts: MachineFacts = { axisCount: 3, machine_mm: [0, 0, 0], offsets, laser: false, ...(modes === undefined ? {} : { modes }) };
    return planResume(core, readProgram("a.nc", source).lines, 3, facts).preamble[0]!;
  };

  it("is in the work system of the machine, unless the program names one", async () => {
    expect(await system("G21G90\nG1X20F600\nX30\n", RAN.modes)).toBe("G21G90G94G17G55");
    expect(await system("G21G90G56\nG1X20F600\nX30\n", RAN.modes)).toBe("G21G90G94G17G56");
    expect(await system("G21G90\nG1X20F600\nX30\n")).toBe("G21G90G94G17G54");
  });
});
