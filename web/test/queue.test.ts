import { expect, it } from "vitest";
import { LineQueue, type Answer } from "../src/link/queue";

/** A small generator of numbers that are the same in every run (Park and Miller). */
function numbers(seed: number): (below: number) => number {
  let state = seed;
  return (below) => {
    state = (state * 48271) % 2147483647;
    return state % below;
  };
}

it("never has more under way than the buffer holds, and gives each line its own answer, in order", () => {
  for (let seed = 1; seed <= 50; seed++) {
    const random = numbers(seed);
    const queue = new LineQueue();
    queue.capacity = 20 + random(200);
    const answered: number[] = [];
    let wire = "";
    for (let i = 0; i < 100; i++) {
      const text = "G1X" + "1".repeat(random(60));
      queue.put({ text, settle: () => answered.push(i) });
    }
    while (answered.length < 100) {
      wire += queue.take();
      const lines = wire.split("\n").length - 1;
      expect(wire.length <= queue.capacity || lines === 1).toBe(true);
      for (let n = 1 + random(lines); n > 0; n--) {
        wire = wire.slice(wire.indexOf("\n") + 1);
        expect(queue.answer(random(5) ? null : 20)).toBe(true);
      }
    }
    expect(answered).toEqual([...Array(100).keys()]);
    expect(queue.idle).toBe(true);
  }
});

it("gives what was said before the answer to the line that is being answered", () => {
  const queue = new LineQueue();
  const answers: Answer[] = [];
  queue.put({ text: "$#", settle: (answer) => answers.push(answer) });
  queue.put({ text: "$G", settle: (answer) => answers.push(answer) });
  expect(queue.take()).toBe("$#\n$G\n");
  queue.hear("[G54:0,0,0]");
  queue.answer(null);
  queue.hear("[GC:G0]");
  queue.answer(8);
  expect(answers).toEqual([
    { kind: "ok", said: ["[G54:0,0,0]"] },
    { kind: "error", code: 8, said: ["[GC:G0]"] },
  ]);
});

it("settles everything when the controller starts anew, and takes no answer for nobody", () => {
  const queue = new LineQueue();
  const kinds: string[] = [];
  for (let i = 0; i < 3; i++) queue.put({ text: "G4P1", settle: (answer) => kinds.push(answer.kind) });
  queue.take();
  queue.forget();
  expect(kinds).toEqual(["lost", "lost", "lost"]);
  expect(queue.answer(null)).toBe(false);
});

it("gives the operator's lines of a parked hold their answers before those that wait", () => {
  const queue = new LineQueue();
  const answered: string[] = [];
  const put = (text: string): void => queue.put({ text, settle: ({ kind }) => answered.push(`${text} ${kind}`) });
  for (const text of ["G1X1", "M0", "G1X2"]) put(text);
  expect(queue.take()).toBe("G1X1\nM0\nG1X2\n");
  queue.answer(null);
  queue.park();
  expect([queue.idle, queue.hasRoom(5)]).toEqual([true, false]);
  for (const text of ["$J=G91Z5F500", "G10L20P0Z0", "G38.2Z-5"]) put(text);
  queue.capacity = "M0 G1X2 $J=G91Z5F500 G10L20P0Z0 ".length;
  expect(queue.take()).toBe("$J=G91Z5F500\nG10L20P0Z0\n");
  queue.answer(null);
  queue.unpark();
  put("G1X3");
  expect(queue.take()).toBe("G1X3\n");
  for (let n = 0; n < 4; n++) queue.answer(null);
  expect(answered).toEqual(["G1X1 ok", "$J=G91Z5F500 ok", "G38.2Z-5 lost", "G10L20P0Z0 ok", "M0 ok", "G1X2 ok", "G1X3 ok"]);
  expect(queue.idle).toBe(true);
});

it("leaves the operator room when a job has filled the buffer", () => {
  const queue = new LineQueue();
  queue.capacity = 2047;
  let size = 0;
  while (queue.hasRoom(29)) {
    queue.put({ text: "G".repeat(29), settle: () => {} });
    size += queue.take().length;
  }
  queue.park();
  queue.put({ text: "$J=G21G91X-12.3456Y-12.3456F10000", settle: () => {} });
  expect(queue.take()).not.toBe("");
  expect([size > 1700, size < 1900]).toEqual([true, true]);
});

it("never sends a jog that was called off before its turn", () => {
  const queue = new LineQueue();
  queue.capacity = 20;
  const answers: string[] = [];
  for (const text of ["$J=G91X1F100", "$J=G91X2F100", "G4P0", "$j=G91X3F100"]) {
    queue.put({ text, settle: (answer) => answers.push(`${text} ${answer.kind}`) });
  }
  expect(queue.take()).toBe("$J=G91X1F100\n");
  queue.callOffJogs();
  expect(answers).toEqual(["$J=G91X2F100 lost", "$j=G91X3F100 lost"]);
  queue.answer(null);
  expect(queue.take()).toBe("G4P0\n");
});
