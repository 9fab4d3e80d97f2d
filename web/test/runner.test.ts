/** A job against a controller that is a few lines of test: every answer by hand, no clock. */
import { expect, it } from "vitest";
import { readProgram } from "../src/job/program";
import { JobRunner } from "../src/job/runner";
import { Controller } from "../src/link/controller";
import { LineError } from "../src/link/line";
import { connect, turn, type Board } from "./board";

async function connected(): Promise<{ board: Board; controller: Controller; job: JobRunner }> {
  const controller = new Controller();
  const job = new JobRunner(controller);
  return { ...(await connect(controller)), job };
}

it("streams within the buffer, and is done when the machine rests after the last line", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\nG1X2\nG1X3\nG1X4\nG1X5\nG1X6\nG1X7\n"));
  job.start();
  let flight = board.heard();
  for (let n = 0; n < 7; n++) {
    expect(flight.length).toBeLessThanOrEqual(40);
    flight = flight.slice(flight.indexOf("\n") + 1);
    board.says("ok");
    await turn();
    flight += board.heard();
  }
  expect([job.state.value, job.executed.value]).toEqual(["running", 0]);
  board.says("<Run|MPos:3.000,0.000,0.000|Ln:4>");
  await turn();
  expect([job.state.value, job.executed.value, job.currentLine.value]).toEqual(["running", 3, 4]);
  board.says("<Idle|MPos:7.000,0.000,0.000|Ln:7>");
  await turn();
  expect(job.state.value).toBe("running"); // one report may be from before the last motion began
  board.says("<Idle|MPos:7.000,0.000,0.000|Ln:7>");
  await turn();
  expect([job.state.value, job.executed.value, job.currentLine.value]).toEqual(["done", 7, 7]);
  await controller.disconnect();
});

it("holds before it resets when a line is refused, and says which", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\nG1X2W\nG1X3\n"));
  job.start();
  board.heard();
  board.says("ok", "error:20");
  await turn();
  expect(board.heard()).toBe("!");
  board.says("<Hold:1|MPos:1.000,0.000,0.000>");
  await turn();
  expect(board.heard()).toBe("");
  board.says("<Hold:0|MPos:1.500,0.000,0.000>");
  await turn();
  expect(board.heard()).toBe("\x18");
  board.says("Grbl 1.1h ['$' for help]");
  expect([job.state.value, job.why.value]).toEqual(["failed", "line 2 (G1X2W): error 20, unsupported code or word"]);
  await controller.disconnect();
});

it("keeps a $ line until everything before it is made", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\n$H\nG1X2\n"));
  job.start();
  expect(board.heard()).toBe("N1G1X1F1000\n");
  board.says("ok");
  await turn();
  expect(board.heard()).toBe("");
  board.says("<Run|MPos:0.500,0.000,0.000>");
  await turn();
  expect(board.heard()).toBe("");
  board.says("<Idle|MPos:1.000,0.000,0.000>");
  await turn();
  expect(board.heard().startsWith("$H\n")).toBe(true);
  await controller.disconnect();
});

it("knows the line that was being executed when the link is lost, not the one that was acknowledged", async () => {
  const { board, job } = await connected();
  job.load(readProgram("a.nc", "(head)\nG1X1F1000\n\nG1X2\nG1X3\n"));
  job.start();
  board.says("ok", "ok", "<Run|MPos:0.500,0.000,0.000|Ln:2>");
  await turn();
  board.lose();
  expect([job.state.value, job.answered.value, job.currentLine.value]).toEqual(["lost", 2, 2]);
  expect(job.why.value).toBe("unplugged; line 2 was being executed");
});

it("takes no line of the job before for one of its own", async () => {
  const { board, controller, job } = await connected();
  board.says("<Idle|MPos:0.000,0.000,0.000|Ln:3>");
  job.load(readProgram("a.nc", "M3\nG1X1F1000\nG1X2\nG1X3\n"));
  job.start();
  board.says("ok", "ok", "ok", "ok", "<Run|MPos:0.000,0.000,0.000|Ln:3>");
  await turn();
  expect([job.executed.value, job.currentLine.value]).toEqual([0, 0]);
  board.says("<Run|MPos:0.500,0.000,0.000|Ln:2>", "<Run|MPos:1.500,0.000,0.000|Ln:3>");
  await turn();
  expect([job.executed.value, job.currentLine.value]).toEqual([2, 3]);
  board.says("<Run|MPos:1.600,0.000,0.000|Ln:99>", "<Run|MPos:1.600,0.000,0.000>");
  await turn();
  expect([job.executed.value, job.currentLine.value]).toEqual([2, 3]);
  await controller.disconnect();
});

it("can be stopped while the last acknowledged lines are cut", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\nG1X2\n"));
  job.start();
  board.heard();
  board.says("ok", "ok", "<Run|MPos:0.500,0.000,0.000|Ln:1>");
  await turn();
  expect(job.active.value).toBe(true);
  job.stop();
  expect(board.heard()).toBe("!");
  board.says("<Hold:0|MPos:0.600,0.000,0.000|Ln:1>");
  await turn();
  expect(board.heard()).toBe("\x18");
  board.says("Grbl 1.1h ['$' for help]");
  expect([job.state.value, job.currentLine.value]).toEqual(["stopped", 1]);
  await controller.disconnect();
});

it.each(["Idle", "Hold:0"])("does not reset a motion that a report from before the hold does not know (%s)", async (before) => {
  const { board, controller, job } = await connected();
  await board.reports(`<${before}|MPos:0.000,0.000,0.000>`);
  job.load(readProgram("a.nc", "G1X1F1000\nG1X2\n"));
  await board.isAsked(); // while nothing moves
  job.start();
  job.stop();
  board.heard();
  await board.reports(`<${before}|MPos:0.000,0.000,0.000>`);
  expect(board.heard()).toBe("");
  await board.reports("<Hold:1|MPos:0.100,0.000,0.000|Ln:1>");
  expect(board.heard()).toBe("");
  await board.reports("<Hold:0|MPos:0.200,0.000,0.000|Ln:1>");
  expect(board.heard()).toBe("\x18");
  await controller.disconnect();
});

it("stops a motion of its own as late as a job", async () => {
  const { board, controller } = await connected();
  await board.isAsked(); // while nothing moves
  void controller.post("G1X5F100");
  controller.stopMotion();
  expect(board.heard()).toBe("G1X5F100\n\x85!");
  await board.reports("<Idle|MPos:0.000,0.000,0.000>");
  await board.reports("<Hold:1|MPos:0.100,0.000,0.000>");
  expect(board.heard()).toBe("");
  await board.reports("<Hold:0|MPos:0.200,0.000,0.000>");
  expect(board.heard()).toBe("\x18");
  await controller.disconnect();
});

it("resets behind no door whose motion still ends", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\n"));
  job.start();
  await board.reports("<Run|MPos:0.100,0.000,0.000|Ln:1>");
  job.stop();
  board.heard();
  for (const state of ["Run", "Door:2", "Door:3"]) {
    await board.reports(`<${state}|MPos:0.100,0.000,0.000|Ln:1>`);
    expect(board.heard()).toBe("");
  }
  await board.reports("<Door:1|MPos:0.200,0.000,0.000|Ln:1>");
  expect(board.heard()).toBe("\x18");
  await controller.disconnect();
});

it("has failed when an alarm ends it, whatever was acknowledged", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\nG1X2\n"));
  job.start();
  board.says("ok", "ok", "<Run|MPos:0.500,0.000,0.000|Ln:1>", "ALARM:1");
  await turn();
  expect(job.state.value).toBe("failed");
  expect(job.why.value).toMatch(/^alarm 1, .*; line 1 was being executed$/);
  await controller.disconnect();
});

it("sends nothing that a controller would take for a real-time command", async () => {
  const { board, controller } = await connected();
  for (const line of ["(\u00c4)", "G0X1!", "G0\u0085"]) await expect(controller.post(line)).rejects.toThrow(LineError);
  expect(board.heard()).toBe("");
  await controller.disconnect();
});

it("knows what was homed, until something may have moved it", async () => {
  const { board, controller } = await connected();
  const home = async (line: string): Promise<void> => {
    const homed = controller.send(line);
    board.says("ok");
    await homed;
  };
  board.says("$44=4", "$45=3", "$46=0");
  await home("$H");
  expect(controller.homed.value).toBe("XYZ");
  controller.reset();
  board.says("Grbl 1.1h ['$' for help]", "<Idle|MPos:0.000,0.000,0.000>");
  expect(controller.homed.value).toBe("XYZ"); // at rest, a reset moves nothing
  board.says("Grbl 1.1h ['$' for help]"); // but no one asked for this one
  expect(controller.homed.value).toBe("");
  await home("$HXZ");
  expect(controller.homed.value).toBe("XZ");
  board.says("ALARM:1");
  expect(controller.homed.value).toBe("");
  await controller.disconnect();
});

it("knows what was homed before it had asked for the cycles", async () => {
  const { board, controller } = await connected();
  const written = controller.send("$45=3");
  const homed = controller.send("$H");
  board.says("ok");
  await written;
  board.says("ok");
  await turn();
  board.says("$44=4", "$45=3", "$46=0", "ok");
  await homed;
  expect(controller.homed.value).toBe("XYZ");
  await controller.disconnect();
});

it("sends no line of the job into a parked hold, and the operator's lines get their own answers", async () => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", "G1X1F1000\nM0\nG1X2\nG1X3\nG1X4\nG1X5\nG1X6\n"));
  job.start();
  board.says("ok", "<Hold:0|MPos:1.000,0.000,0.000|Ln:1>");
  await turn();
  board.heard();
  controller.realtime("PARK");
  board.says("[MSG:Parked: jog, probe, set zero; ~ returns to the job]", "<Hold:0|MPos:1.000,0.000,0.000|Ln:1>");
  await turn();
  expect([board.heard(), controller.operates.value]).toEqual(["\xa3$G\n", true]); // G1X1 may have changed it
  board.says("[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]", "ok");
  await turn();
  const jog = controller.send("$J=G91Z5F500");
  expect(board.heard()).toBe("$J=G91Z5F500\n");
  board.says("error:170");
  await expect(jog).rejects.toThrow("error 170");
  expect(job.state.value).toBe("running"); // its own line was not refused
  controller.realtime("RESUME");
  board.says("[MSG:Not resumed: with the new offsets the job leaves the travel]");
  expect([controller.parked.value, controller.notParked.value]).toEqual([false, "with the new offsets the job leaves the travel"]);
  controller.realtime("PARK");
  board.says("[MSG:Parked: jog, probe, set zero; ~ returns to the job]", "<Hold:0|MPos:1.000,0.000,0.000|Ln:1>");
  await turn();
  expect(controller.notParked.value).toBe("");
  controller.realtime("RESUME");
  board.heard();
  board.says("<Run|MPos:1.000,0.000,0.000|Ln:1>", "ok");
  await turn();
  expect([controller.parked.value, job.answered.value]).toEqual([false, 2]);
  expect(board.heard()).toMatch(/^N\d+G1X/);
  await controller.disconnect();
});

it("asks the network's own server with other questions: its answers come in turn", async () => {
  const { board, controller } = await connected();
  const settings = controller.send("$$");
  const listed = controller.send("$TRUST");
  await turn();
  expect(board.heard()).toBe("$$\n$TRUST\n");
  board.says("$100=250.000", "ok", "[TRUST:1,192.168.1.20,always]", "ok");
  expect(await settings).toEqual(["$100=250.000"]);
  expect(await listed).toEqual(["[TRUST:1,192.168.1.20,always]"]);
});

it.each([
  ["M0 (Größe prüfen)", "Große prufen", "Größe prüfen"],
  ["(MSG, Höhe [neu])", "Hohe (neu)", "Höhe [neu]"],
])("shows what the program says as it is written: %s", async (line, said, written) => {
  const { board, controller, job } = await connected();
  job.load(readProgram("a.nc", `G1X1F1000\n${line}\nG1X2\n`));
  job.start();
  board.says("ok", `[MSG:${said.replace("ß", "")}]`);
  await turn();
  expect(job.says.value).toBe(written);
  await controller.disconnect();
});
