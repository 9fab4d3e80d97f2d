/** Whether a controller serves this page, and the first connection to it. Pure: who asks and who waits are given. */

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

/** Connect when the page begins. A page and all its files are loaded at that time, so the chip, or a busy computer, may have no place
 * for its stream yet: it is tried again, until it is open or a person has chosen another link.
 * @param open  shows why it fails @param isFree  no link is open or being opened */
export async function connectFirst(open: () => Promise<void>, isFree: () => boolean, wait: (ms: number) => Promise<void>): Promise<void> {
  for (const ms of [...AGAIN_MS, 0]) {
    if (!isFree()) return;
    await open();
    if (ms > 0 && isFree()) await wait(ms);
  }
}
