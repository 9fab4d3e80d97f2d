/** Keeps the job of the page over a reload: text and place in, and what was kept out again. It starts nothing. */
import { effect, signal, untracked } from "@preact/signals";
import { attempt, controller, job, store, stored } from "./app";
import { forgetKept, keepJob, keepPlace, readKept, type KeptJob, type KeptPlace } from "./job/kept";
import { readProgram } from "./job/program";
import type { JobState } from "./job/runner";
import { t } from "./words";

/** Why a reload loses the job; "": it does not. */
export const notKept = signal("");

/** The job that was closed last, by its id: written immediately, as a page that is loaded again does not wait for a database. */
const CLOSED = "wificnc-closed-job";

let kept: KeptJob | null = null;

function place(): KeptPlace {
  return { id: kept!.id, line: job.resumeLine.peek(), state: job.state.peek(), why: job.why.peek(), machine: controller.linkName.peek() };
}

async function written(work: Promise<void>): Promise<void> {
  await work.then(
    () => (notKept.value = ""),
    (error: unknown) => (notKept.value = error instanceof Error ? error.message : String(error)),
  );
}

function followProgram(): void {
  const program = job.program.value;
  if (program && program.source !== kept?.source) {
    kept = { id: `${Date.now()}-${Math.random()}`, name: program.name, source: program.source };
    void written(keepJob(kept, untracked(place)));
  } else if (!program && kept) {
    store(CLOSED, kept.id);
    void written(forgetKept(kept.id));
    kept = null;
  }
}

/** At each report that names another line: one that was not written any more cuts a line again, and leaves none out. */
function followPlace(): void {
  void [job.state.value, job.resumeLine.value];
  if (kept) void written(keepPlace(place(), job.active.peek() ? kept : null));
}

const UNDER_WAY = new Set(["running", "stopping"]);
const ENDED = new Set(["lost", "stopped", "failed", "left"]);

function restore(text: KeptJob, { state, line, why, machine }: KeptPlace): void {
  const program = readProgram(text.name, text.source);
  kept = text;
  if (UNDER_WAY.has(state)) job.restore(program, "left", line, t`It was being sent to ${machine}; line ${line} was being executed at the last report.`);
  else job.restore(program, ENDED.has(state) ? (state as JobState) : "ready", line, why);
}

/** Bring back what was kept, unless a job was loaded meanwhile; and keep from now on. */
export async function startKeeping(): Promise<void> {
  const found = await readKept().catch((error: unknown) => void (notKept.value = String(error)));
  if (found?.job.id === stored(CLOSED)) void written(forgetKept(found!.job.id));
  else if (found && !job.program.peek()) await attempt(async () => restore(found.job, found.place));
  effect(followProgram);
  effect(followPlace);
}
