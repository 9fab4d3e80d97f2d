/** Whether a controller serves this page. Pure: who asks and who waits are given. */

/** A chip that has no place for one more request, or a request that was lost in the air: it is asked again after these. */
const AGAIN_MS = [300, 1000, 3000, 9000];

/** The answer of `api/controller`; null: no server gives one. */
export async function askWhoServes(ask: () => Promise<Response>, wait: (ms: number) => Promise<void>): Promise<Response | null> {
  for (const ms of [...AGAIN_MS, 0]) {
    const answer = await ask().catch(() => null);
    if (answer && answer.status < 500) return answer;
    if (ms > 0) await wait(ms);
  }
  return null;
}
