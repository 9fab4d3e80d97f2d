import { expect, it } from "vitest";
import { askWhoServes, connectFirst } from "../src/link/served";

/** Answers in this order; null: the request is lost. */
function asked(statuses: (number | null)[]): { ask: () => Promise<Response>; wait: (ms: number) => Promise<void>; waits: number[] } {
  const waits: number[] = [];
  return {
    ask: async () => {
      const status = statuses.shift();
      if (status === null || status === undefined) throw new TypeError("Failed to fetch");
      return new Response("", { status });
    },
    wait: async (ms) => void waits.push(ms),
    waits,
  };
}

it("takes the first answer", async () => {
  const { ask, wait, waits } = asked([200]);
  expect((await askWhoServes(ask, wait))?.status).toBe(200);
  expect(waits).toEqual([]);
});

it("asks again when the request is lost, or the chip has no place for it", async () => {
  const { ask, wait, waits } = asked([null, 503, 200]);
  expect((await askWhoServes(ask, wait))?.status).toBe(200);
  expect(waits).toHaveLength(2);
});

it("does not ask a server again that has no controller", async () => {
  const { ask, wait, waits } = asked([404, 200]);
  expect((await askWhoServes(ask, wait))?.status).toBe(404);
  expect(waits).toEqual([]);
});

it("gives up where no one answers, as without a network", async () => {
  const { ask, wait, waits } = asked([]);
  expect(await askWhoServes(ask, wait)).toBeNull();
  expect(waits.reduce((sum, ms) => sum + ms, 0)).toBeLessThan(20_000);
});

/** A link that opens at its turn; at `taken` a person has connected by another one meanwhile. */
function tried(opensAt: number, taken = Infinity): { opens: () => number; run: Promise<void> } {
  let [opens, waits] = [0, 0];
  const run = connectFirst(
    async () => void opens++,
    () => opens < opensAt && waits < taken,
    async () => void waits++,
  );
  return { opens: () => opens, run };
}

it.each([
  ["once where it opens", 1, Infinity, 1],
  ["again where it does not", 3, Infinity, 3],
  ["no more where a person was faster", 9, 1, 1],
  ["five times at most", 9, Infinity, 5],
])("connects %s", async (_, opensAt, taken, times) => {
  const { opens, run } = tried(opensAt, taken);
  await run;
  expect(opens()).toBe(times);
});
