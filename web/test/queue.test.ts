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
