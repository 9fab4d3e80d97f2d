/** Keeps the job of the page over a reload: text and place in, and what was kept out again. It starts nothing. */
import { effect, signal, untracked } from "@preact/signals";
import { attempt, controller, fail, job, store, stored } from "./app";
import { beganOf } from "./job/began";
import { DamagedError, forgetDamaged, forgetKept, keepJob, keepPlace, readKept, type KeptJob, type KeptPlace } from "./job/kept";
import { readProgram } from "./job/program";
import { INTERRUPTED, type JobState } from "./job/runner";
import { Tabs } from "./job/tabs";
import { t } from "./words";

/** Why a reload loses the job; "": it does not. */
export const notKept = signal("");

/** The job that was closed last, by its id: written immediately, as a page that is loaded again does not wait for a database. */
const CLOSED = "wificnc-closed-job";

let kept: KeptJob | null = null;
/** The job of another tab, which this one leaves alone; "": none. */
let others = "";
const tabs = new Tabs((id) => kept?.id === id);

function place(): KeptPlace {
  return { id: kept!.id, line: job.resumeLine.peek(), state: job.state.peek(), why: job.why.peek(), machine: controller.linkName.peek(), start: controller.startId.peek(), began: job.began.peek() };
}

async function written(work: Promise<boolean | void>): Promise<void> {
  await work.then(
    (isKept) => void (isKept !== false && (notKept.value = "")), // false: why it is not kept is known already
    (error: unknown) => (notKept.value = error instanceof Error ? error.message : String(error)),
  );
}

function followProgram(): void {
  const program = job.program.value;
  if (program && program.source !== kept?.source) {
    kept = { id: `${Date.now()}-${Math.random()}`, name: program.name, source: program.source };
    void keepUnlessOthers(kept);
  } else if (!program && kept) {
    store(CLOSED, kept.id);
    void written(forgetKept(kept.id));
    kept = null;
  }
}

async function keepUnlessOthers(text: KeptJob): Promise<void> {
  if (others && (await tabs.elsewhere(others))) {
    notKept.value = t`Another tab of this browser keeps its job`;
    return;
  }
  others = "";
  if (kept === text) await written(keepJob(text, untracked(place)));
}

/** At each report that names another line: one that was not written any more cuts a line again, and leaves none out. */
function followPlace(): void {
  void [job.state.value, job.resumeLine.value, job.began.value];
  if (kept && !others) void written(keepPlace(place(), job.active.peek() ? kept : null));
}

const UNDER_WAY = new Set(["running", "stopping"]);

function restore(text: KeptJob, { state, line, why, machine, start, began }: KeptPlace): void {
  const program = readProgram(text.name, text.source);
  kept = text;
  if (UNDER_WAY.has(state)) job.restore(program, "left", line, t`It was being sent to ${machine}; line ${line} was being executed at the last report.`, beganOf(began));
  else job.restore(program, INTERRUPTED.has(state as JobState) ? (state as JobState) : "ready", line, why, beganOf(began));
  controller.expectStart(start ?? "");
}

async function found(): Promise<{ job: KeptJob; place: KeptPlace } | null> {
  try {
    return await readKept();
  } catch (error) {
    notKept.value = error instanceof DamagedError ? "" : String(error);
    if (!(error instanceof DamagedError)) return null;
    fail(error);
    await written(forgetDamaged());
    return null;
  }
}

/** Bring back what was kept, unless a job was loaded meanwhile or another tab has it; and keep from now on. */
export async function startKeeping(): Promise<void> {
  const old = await found();
  if (old && (await tabs.elsewhere(old.job.id))) others = old.job.id;
  else if (old?.job.id === stored(CLOSED)) void written(forgetKept(old!.job.id));
  else if (old && !job.program.peek()) await attempt(async () => restore(old.job, old.place));
  effect(followProgram);
  effect(followPlace);
}
