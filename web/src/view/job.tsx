/** A job: dropped, checked on the real core, looked at, sent, and resumed where it ended. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { attempt, checkJob, controller, fail, held, isStale, job, noLines, noPlace, preflight, standing, unknownYet } from "../app";
import { describe, secondsAtLine, secondsLeft, type Preflight } from "../job/preflight";
import { discarded, namesSystem, otherSystem } from "../job/began";
import type { Report } from "../job/core";
import { laserWarning } from "../job/engraving";
import { endingWords } from "../job/ending";
import { readProgram } from "../job/program";
import { type MachineFacts, type Resume } from "../job/resume";
import { NOWHERE, travelFindings, unplacedAxes, type TravelFinding } from "../job/standing";
import { notKept } from "../keeping";
import { AXES, settingNumber } from "../tables";
import { OverrideCard } from "./control";
import { FrameButton } from "./frame";
import { Button, Card, Dialog, Field, FileButton, Notice, Progress, StartStop, duration } from "./parts";
import { PathView } from "./path";
import { msg, t, tr } from "../words";

const ACCEPT = ".nc,.ngc,.gcode,.gc,.tap,.cnc,.txt";
const FINDINGS_SHOWN = 8;
const LASER_MODE = settingNumber("laser_mode");

export function JobTab(): JSX.Element {
  useEffect(checkKept, [job.program.value]);
  if (!job.program.value)
    return (
      <Card title={t`Job`}>
        <Drop />
      </Card>
    );
  return (
    <div class="columns job">
      <div class="w8 stack">
        <PathCard />
      </div>
      <div class="w4 stack">
        <RunCard />
        <OverrideCard />
        <RunMessages />
        <CheckCard />
      </div>
    </div>
  );
}

/** A job that was kept over a reload is checked when someone looks at it. */
function checkKept(): void {
  const isChecked = preflight.result.value || preflight.progress.value !== null || preflight.failed.value;
  if (job.program.value && !isChecked) void attempt(checkJob);
}

// ---- the file ----

function Drop(): JSX.Element {
  const over = useSignal(false);
  return (
    <div
      class={`drop ${over.value ? "over" : ""}`}
      onDragOver={(event) => {
        event.preventDefault();
        over.value = true;
      }}
      onDragLeave={() => (over.value = false)}
      onDrop={() => (over.value = false)}
    >
      <strong>{t`Drop a G-code file here`}</strong>
      <span class="small">{t`The file is not uploaded. The path and the time are computed by the controller's core in this browser.`}</span>
      <FileButton accept={ACCEPT} kind="primary" onFile={(file) => void attempt(() => open(file))} testId="job-file">
        {t`Choose a file`}
      </FileButton>
    </div>
  );
}

function close(): void {
  job.unload();
  preflight.forget();
}

/** Rejects with what forbids it: nothing is changed then. */
export async function open(file: File): Promise<void> {
  if (job.active.value) throw new Error(t`A job is running: stop it first`);
  if (job.program.value && held.value) throw new Error(held.value);
  job.unload(); // also when the new file cannot be read: what is shown is what Start would send
  preflight.forget();
  job.load(readProgram(file.name, await file.text()));
  await checkJob();
}

function PathCard(): JSX.Element {
  const done = preflight.result.value;
  const program = job.program.value!;
  return (
    <Card
      title={program.name}
      tools={
        <>
          <FileButton accept={ACCEPT} onFile={(file) => void attempt(() => open(file))} testId="job-file">
            {t`Other file`}
          </FileButton>
          <Button why={(job.active.value && t`Stop the job first.`) || held.value} title={t`This browser keeps the job until then`} onClick={close} testId="job-close">
            {t`Close`}
          </Button>
        </>
      }
    >
      {preflight.progress.value !== null && (
        <>
          <p class="soft small">{t`Checking the job in virtual time.`}</p>
          <Progress value={preflight.progress.value} label={t`Preflight`} />
        </>
      )}
      {preflight.failed.value && <Notice kind="bad" title={preflight.failed.value} />}
      <NotRun />
      {done && <PathView preflight={done} />}
      <CodeAround />
    </Card>
  );
}

const AROUND = 3;

/** The lines at which the job is. */
function CodeAround(): JSX.Element {
  const program = job.program.value!;
  const at = Math.max(0, program.lines.findIndex((line) => line.number >= job.currentLine.value));
  const shown = program.lines.slice(Math.max(0, at - AROUND), at + AROUND + 1);
  return (
    <pre class="code" aria-label={t`Lines of the job`}>
      {shown.map((line) => `${line.number === job.currentLine.value ? "▸" : " "} ${String(line.number).padStart(5)}  ${line.text}\n`)}
    </pre>
  );
}

// ---- what the preflight found ----

/** What follows the program in its file. */
function NotRun(): JSX.Element | null {
  const words = endingWords(job.program.value!.ending);
  return words && <Notice kind="warn" title={words.title} text={words.text} />;
}

function CheckCard(): JSX.Element | null {
  const done = preflight.result.value;
  if (unknownYet.value && !job.active.value)
    return (
      <Card title={t`Preflight`}>
        <Notice kind="info" title={t`The job is checked when the machine is known`} text={unknownYet.value} />
      </Card>
    );
  if (!done || isStale.value) return null;
  const { report } = done;
  const warning = laserWarning(report, done.standing.origin_mm);
  return (
    <Card title={t`Preflight`} tools={<Button size="small" onClick={() => void attempt(checkJob)}>{t`Check again`}</Button>}>
      {report.error_count === 0 ? (
        travel(done).length === 0 && !noPlace.value && <Notice kind="good" title={t`Check passed`} />
      ) : (
        <Notice kind="bad" title={report.error_count === 1 ? t`One line is refused` : t`${report.error_count} lines are refused`} />
      )}
      {report.error_count > 0 && (
        <ul class="small">
          {report.errors.slice(0, FINDINGS_SHOWN).map((error) => (
            <li key={`${error.line}-${error.code}`}>{describe(error)}</li>
          ))}
        </ul>
      )}
      {travel(done).map((finding) => (
        <Notice key={finding.axis} kind="bad" title={t`${finding.axis}: the job does not fit the machine`} text={finding.text} />
      ))}
      {warning && <Notice kind="warn" title={warning.title} text={warning.text} />}
      <ToolChanges report={report} />
      <Figures done={done} />
      <p class="small faint" data-test="checked-with">
        {checkedWith(done)}
      </p>
    </Card>
  );
}

function travel({ standing, report }: Preflight): TravelFinding[] {
  return travelFindings(standing, report.min_mm, report.max_mm);
}

function checkedWith({ standing, report, refused }: Preflight): string {
  if (standing === NOWHERE) return t`With default settings, work zero at machine zero: connect to check it on your machine.`;
  const unplaced = [...unplacedAxes(standing, report.min_mm, report.max_mm)].join(", ");
  const text = t`With the settings, the offsets and the place of the connected machine.`;
  const place = unplaced && t` ${unplaced}: not homed, so whether the job fits there is not known.`;
  return `${text}${place}${refused.length > 0 ? t` This page's core did not accept ${refused.join(", ")}.` : ""}`;
}

function ToolChanges({ report }: { report: Report }): JSX.Element | null {
  const shown = report.tool_changes.slice(0, FINDINGS_SHOWN);
  const more = report.tool_change_count - shown.length;
  if (shown.length === 0) return null;
  return (
    <div class="small" data-test="tool-changes">
      {t`The machine waits for Resume at each tool change (M6):`}
      <ul>
        {shown.map(({ line, tool }, i) => (
          <li key={i}>
            {t`Line ${line}: T${tool}`}
          </li>
        ))}
        {more > 0 && <li>{t`and ${more} more`}</li>}
      </ul>
    </div>
  );
}

function Figures({ done }: { done: Preflight }): JSX.Element {
  const { report } = done;
  const { origin_mm } = done.standing;
  const axes = [...AXES].filter((_, i) => report.max_mm[i]! > report.min_mm[i]! || i < 3);
  return (
    <>
      <dl class="facts">
        <dt>{t`Time`}</dt>
        <dd data-test="job-time">{duration(report.seconds)}</dd>
        <dt>{t`Cutting, rapids`}</dt>
        <dd>
          {duration(report.cutting_seconds)}, {duration(report.rapid_seconds)}
        </dd>
      </dl>
      <div class="scroll">
        <table>
          <thead>
            <tr>
              <th>{t`Axis`}</th>
              <th class="number">{t`from`}</th>
              <th class="number">{t`to`}</th>
              <th class="number">{t`fastest`}</th>
            </tr>
          </thead>
          <tbody>
            {axes.map((axis) => {
              const i = AXES.indexOf(axis);
              return (
                <tr key={axis}>
                  <td>{axis}</td>
                  <td class="number mono">{(report.min_mm[i]! - (origin_mm[i] ?? 0)).toFixed(2)}</td>
                  <td class="number mono">{(report.max_mm[i]! - (origin_mm[i] ?? 0)).toFixed(2)}</td>
                  <td class="number mono">{(report.max_speed_mm_s[i]! * 60).toFixed(0)}</td>
                </tr>
              );
            })}
          </tbody>
        </table>
      </div>
    </>
  );
}

// ---- sending ----

const RESULT: Record<string, { kind: "good" | "warn" | "bad"; title: string }> = {
  done: { kind: "good", title: msg`The job is finished` },
  stopped: { kind: "warn", title: msg`The job was stopped` },
  failed: { kind: "bad", title: msg`The job ended with an error` },
  lost: { kind: "bad", title: msg`The connection was lost during the job` },
  taken: { kind: "bad", title: msg`Another client took control during the job` },
  restarted: { kind: "bad", title: msg`The controller restarted: this job cannot be resumed` },
  left: { kind: "bad", title: msg`This page was closed or loaded again during the job` },
};

/** Why a start wants a second thought. */
function doubts(): string[] {
  const done = preflight.result.value;
  if (!done || isStale.value) return [t`The preflight has not finished.`];
  if (noPlace.value) return [noPlace.value];
  const { error_count } = done.report;
  const lines = error_count === 1 ? t`One line is refused` : t`${error_count} lines are refused`;
  return [...(error_count > 0 ? [t`${lines}: the job will stop there.`] : []), ...travel(done).map((finding) => finding.text)];
}

function StartDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const again = job.ended.value;
  const reasons = [...doubts(), ...(again ? changedSince() : [])];
  return (
    <Dialog
      title={again ? t`Run the job again from its first line?` : t`Start this job all the same?`}
      onClose={onClose}
      actions={
        <div class="row">
          <Button
            kind={reasons.length > 0 ? "danger" : "primary"}
            icon="play"
            machine="starts"
            why={whyNoStart()}
            onClick={() => (onClose(), job.start())}
            testId={again ? "run-again-start" : "start-anyway"}
          >
            {again ? t`Run again from the start` : t`Start`}
          </Button>
          <Button onClick={onClose}>{t`Cancel`}</Button>
        </div>
      }
    >
      {again && <p>{t`The whole job runs from the start, from where the machine is now. Check that the way to its first cut is free.`}</p>}
      <ul>
        {reasons.map((text) => (
          <li key={text}>{text}</li>
        ))}
      </ul>
    </Dialog>
  );
}

/** A stop, a reset and the end of a program leave G54, and a reset no tool length: the job would run elsewhere. */
function changedSince(): string[] {
  const [began, now] = [job.began.value, job.standsIn()];
  const systems = namesSystem(job.program.value!.lines) ? null : otherSystem(began, now);
  const words = systems && [t`The job ran in ${systems.then}, and the machine is in ${systems.now} now. To run it there again, choose ${systems.then} on the tab Control first.`];
  return [...(words ?? []), ...discarded(began, now)];
}

/** Why no job can be started now; "": one can. */
function whyNoStart(): string {
  if (!controller.connected.value) return t`Connect first.`;
  return noLines.value || (controller.state.value === "Idle" ? "" : t`The machine must be idle.`);
}

function RunCard(): JSX.Element {
  const asks = useSignal(false);
  const state = job.state.value;
  const total = job.total;
  const ended = job.ended.value && t`The job has ended: run it again from the start, or resume it from a line, below.`;
  const why = !job.active.value && (whyNoStart() || ended);
  return (
    <Card title={t`Run the job`}>
      <StartStop
        start={{ text: t`Start`, why, onClick: () => (doubts().length > 0 ? (asks.value = true) : job.start()), testId: "job-start" }}
        stop={{ text: state === "stopping" ? t`Stopping` : t`Stop the job`, onClick: () => job.stop(), testId: "job-stop" }}
        runs={job.active.value}
        isStopping={state === "stopping"}
      >
        <FrameButton />
      </StartStop>
      {asks.value && <StartDialog onClose={() => (asks.value = false)} />}
      <p class="small soft reserved">{why}</p>
      <Progress value={total ? job.executed.value / total : 0} label={t`Lines executed`} />
      <dl class="facts">
        <dt>{t`Lines`}</dt>
        <dd data-test="job-lines">
          {t`${job.executed.value} of ${total}`}
        </dd>
        <dt>{t`Time left`}</dt>
        <dd>{timeLeft()}</dd>
      </dl>
      <ResumeBar />
    </Card>
  );
}

/** Below all controls of the job and the overrides: they come while a thumb is on one of those. */
function RunMessages(): JSX.Element | null {
  const result = RESULT[job.state.value];
  const says = job.says.value;
  if (!says && !result && !notKept.value) return null;
  return (
    <div class="run-messages">
      {says && <Notice kind="warn" title={says} text={controller.state.value === "Hold" ? t`The program waits for Resume.` : ""} />}
      {result && <Notice kind={result.kind} title={tr(result.title)} text={job.why.value} />}
      {notKept.value && <Notice kind="warn" title={t`This browser does not keep the job (${notKept.value}): a reload of the page loses it.`} />}
    </div>
  );
}

/** Of the simulated time, by the overrides. */
function timeLeft(): string {
  const done = preflight.result.value;
  if (!done) return "–";
  const over = job.state.value === "done";
  const spent = over ? done.report.seconds : job.currentLine.value > 0 ? secondsAtLine(done.timeline, job.currentLine.value) : 0;
  const [feed, rapid] = controller.overrides.value;
  return duration(secondsLeft(done.report, spent, feed, rapid));
}

/** Continue at a line: after a lost link, a stop, an error; or begin there. And the whole job once more. */
function ResumeBar(): JSX.Element {
  const typed = useSignal<number | null>(null);
  const plan = useSignal<Resume | null>(null);
  const asks = useSignal(false);
  useEffect(() => void (typed.value = null), [job.active.value, job.program.value]); // of the run before, or of another file
  const ended = job.ended.value;
  const suggested = Math.max(1, job.resumeLine.value);
  const line = typed.value ?? suggested;
  const why = whyNoStart();
  const type = (input: HTMLInputElement): void => {
    const number = Number(input.value);
    typed.value = Number.isInteger(number) && number >= 1 ? number : null;
    if (typed.value === null) input.value = String(suggested);
  };
  const make = (): Promise<void> =>
    attempt(async () => {
      await controller.rest(); // facts are of where it is
      plan.value = (await preflight.plan(job.program.value!.lines, line, facts())) ?? plan.value;
    });
  const isPartly = ended && job.state.value !== "done";
  return (
    <>
      <div class="row">
        <Field
          label={isPartly ? t`Resume from line` : t`Start from line`}
          hint={isPartly ? t`The line that was being executed at the controller's last report.` : t`The state of the lines before is restored first: you see how.`}
        >
          <input
            class="input short mono"
            type="number"
            min={1}
            max={job.program.value!.lines.at(-1)!.number}
            value={line}
            disabled={job.active.value}
            onChange={(event) => type(event.currentTarget)}
            data-test="resume-line"
          />
        </Field>
        <Button why={noPlace.value || why} onClick={() => void make()} testId="resume-plan">
          {isPartly ? t`Prepare resume` : t`Prepare start`}
        </Button>
        <Button icon="play" why={why} disabled={!ended} onClick={() => (asks.value = true)} testId="run-again">
          {t`Run again from the start`}
        </Button>
      </div>
      {asks.value && <StartDialog onClose={() => (asks.value = false)} />}
      {plan.value && <ResumeDialog plan={plan.value} onClose={() => (plan.value = null)} />}
    </>
  );
}

function facts(): MachineFacts {
  const { machine_mm, offsets, settings, modes } = standing.value;
  return {
    axisCount: controller.axisCount.value,
    machine_mm: [...machine_mm],
    offsets: Object.fromEntries([...offsets].map(([row, mm]) => [row, [...mm]])),
    modes: (job.ended.value && job.began.value.modes) || modes,
    laser: Number(settings.get(LASER_MODE) ?? 0) > 0,
  };
}

function resumedIn(): string[] {
  if (!job.ended.value) return [];
  const [began, now] = [job.began.value, job.standsIn()];
  const systems = otherSystem(began, now);
  return [...(systems ? [t`The job ran in ${systems.then}, and the machine is in ${systems.now} now: the resume takes what the job had.`] : []), ...discarded(began, now)];
}

function ResumeDialog({ plan, onClose }: { plan: Resume; onClose: () => void }): JSX.Element {
  const go = (): void => {
    onClose();
    try {
      job.start(plan.lines);
    } catch (error) {
      fail(error);
    }
  };
  return (
    <Dialog
      title={t`Resume from line ${plan.line}`}
      onClose={onClose}
      actions={
        <div class="row">
          <Button kind="primary" icon="play" machine="starts" why={whyNoStart()} onClick={go} testId="resume-start">
            {t`Start resume`}
          </Button>
          <Button onClick={onClose}>{t`Cancel`}</Button>
        </div>
      }
    >
      <p class="soft">{t`Before the first cut the machine does the following. Watch it, and be ready to press Hold.`}</p>
      <pre class="code" data-test="resume-preamble">
        {plan.preamble.join("\n")}
      </pre>
      {[...plan.notes, ...resumedIn()].map((note) => (
        <Notice key={note} kind="warn" title={note} />
      ))}
    </Dialog>
  );
}
