/** A job against a controller that is a few lines of test: every answer by hand, no clock. */
import { expect, it } from "vitest";
import { readProgram } from "../src/job/program";
import { JobRunner } from "../src/job/runner";
import { Controller } from "../src/link/controller";
import type { Transport, TransportEvents } from "../src/link/transport";

class Board implements Transport {
  readonly name = "a test";
  readonly isSerial = true;
  sent = "";
  private events: TransportEvents | null = null;

  async open(events: TransportEvents): Promise<void> {
    this.events = events;
    queueMicrotask(() => this.says("<Idle|MPos:0.000,0.000,0.000>"));
  }
  async write(bytes: Uint8Array): Promise<void> {
    this.sent += new TextDecoder("latin1").decode(bytes).replaceAll("?", "");
  }
  async close(): Promise<void> {}

  says(...lines: string[]): void {
    this.events!.bytes(new TextEncoder().encode(lines.map((line) => `${line}\r\n`).join("")));
  }
  lose(): void {
    this.events!.lost("unplugged");
  }
  /** What was sent since the last time. */
  heard(): string {
    const sent = this.sent;
    this.sent = "";
    return sent;
  }
}

/** Connected, and past the questions of the beginning. */
async function connected(): Promise<{ board: Board; controller: Controller; job: JobRunner }> {
  const [board, controller] = [new Board(), new Controller()];
  const job = new JobRunner(controller);
  const open = controller.connect(board);
  for (const line of ["$I", "$$", "$#", "$G"]) {
    await turn();
    expect(board.heard()).toBe(`${line}\n`);
    board.says(...(line === "$I" ? ["[OPT:V,15,41]"] : []), "ok");
  }
  await open;
  return { board, controller, job };
}

/** Whatever waits for what was said goes on. */
const turn = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));

it("streams within the buffer, and is done when every line is answered", async () => {
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
  expect(job.state.value).toBe("done");
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
  expect(board.heard()).toBe("G1X1F1000\n");
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

it("knows the last acknowledged line when the link is lost", async () => {
  const { board, job } = await connected();
  job.load(readProgram("a.nc", "(head)\nG1X1F1000\n\nG1X2\nG1X3\n"));
  job.start();
  board.says("ok", "ok");
  await turn();
  board.lose();
  expect([job.state.value, job.lastAnsweredLine.value]).toEqual(["lost", 4]);
  expect(job.why.value).toBe("unplugged; line 4 was the last one acknowledged");
});
