/** Set a machine up for the first time, step by step. It writes settings as the tab Settings does, says which, and can
 * be left and continued. */
import { computed, effect, signal, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, controller, noHoming, noMotion, store, stored, unknownYet } from "../app";
import { corrected, flipped, measure, readProgress, stepsPerMm } from "../link/guide";
import { Jogger } from "../link/jog";
import { same, sendingOrder } from "../link/settingsfile";
import { readSettings } from "../link/settingsimport";
import { AXES, findSetting, settingNumber, settingProblem } from "../tables";
import { ApplyDialog, MachineChoice } from "./apply";
import { Button, Card, Field, FileButton, Notice } from "./parts";
import { msg, t, tr } from "../words";

const KEY = "wificnc.guide";
const JOG_MM = 5;
const MEASURED_MM = 50;
const FEED = 600;
const [STEPS, RATE, ACCELERATION, TRAVEL] = ["steps_per_mm", "max_rate_mm_min", "acceleration_mm_s2", "max_travel_mm"].map(settingNumber) as [number, number, number, number];
const [DIRECTIONS, LIMITS, HOMING, HOME_DIRECTIONS] = ["dir_invert_mask", "limit_invert", "homing", "homing_dir_mask"].map(settingNumber) as [number, number, number, number];

const PARTS: readonly { title: string; view: () => JSX.Element }[] = [
  { title: msg`Machine`, view: Machine },
  { title: msg`Switches`, view: Switches },
  { title: msg`Directions`, view: Directions },
  { title: msg`Steps per mm`, view: Measure },
  { title: msg`Homing`, view: Homing },
  { title: msg`First move`, view: FirstMove },
];

const progress = signal(readProgress(stored(KEY), PARTS.length));
effect(() => store(KEY, JSON.stringify(progress.value)));

const jogger = new Jogger(controller);
const axes = computed(() => [...AXES.slice(0, controller.axisCount.value)]);
const now = (number: number): string => controller.settings.value.get(number) ?? "";
/** What was typed, by field. */
const typed = signal<Readonly<Record<string, string>>>({});

function go(step: number): void {
  progress.value = { ...progress.value, step };
}

/** What is being written: a second press would take it back, as most of these turn something round. */
const writing = signal(false);
const whyNoWrite = (): string => (writing.value ? t`Writing` : noHoming.value);

async function write(values: ReadonlyMap<number, string>): Promise<void> {
  writing.value = true;
  await writeNow(values).finally(() => (writing.value = false));
}

/** Send what differs, one after the other, and note what was written. Rejects with the first refusal. */
async function writeNow(values: ReadonlyMap<number, string>): Promise<void> {
  if (controller.state.value !== "Alarm") await controller.rest(); // a jog may have been sent just before
  for (const number of sendingOrder(values.keys())) {
    const [before, after] = [now(number), values.get(number)!];
    const setting = findSetting(number);
    if (before === "" || !setting || same(setting.row, before, after)) continue;
    const problem = settingProblem(setting.row, after);
    if (problem) throw new Error(`$${number} ${setting.row.name}: ${problem}`);
    await controller.send(`$${number}=${after}`);
    note(number, before, after);
  }
  await controller.send("$$");
}

function note(number: number, before: string, after: string): void {
  const setting = findSetting(number);
  const line = `$${number} ${setting?.row.name ?? ""} ${setting?.axis ?? ""}: ${Number(before)} → ${Number(after)}`;
  progress.value = { ...progress.value, written: [...progress.value.written, line] };
}

export function GuideTab(): JSX.Element {
  const { step, written } = progress.value;
  const part = PARTS[step]!;
  const View = part.view;
  if (controller.settings.value.size === 0 || controller.axisCount.value === 0)
    return (
      <Card title={t`Set up the machine`}>
        <p class="soft">{unknownYet.value || t`Connect to a controller to set up its machine.`}</p>
      </Card>
    );
  return (
    <div class="columns">
      <div class="w7 stack">
        <Card title={`${step + 1}. ${tr(part.title)}`}>
          <div class="row" role="group" aria-label={t`Steps of the guide`}>
            {PARTS.map(({ title }, i) => (
              <Button key={title} size="small" kind={i === step ? "primary" : "plain"} pressed={i === step} onClick={() => go(i)}>
                {tr(title)}
              </Button>
            ))}
          </div>
          <View />
          <div class="row">
            {step > 0 && <Button onClick={() => go(step - 1)}>{t`Back`}</Button>}
            {step + 1 < PARTS.length && (
              <Button kind="primary" onClick={() => go(step + 1)} testId="guide-next">
                {t`Next`}
              </Button>
            )}
          </div>
        </Card>
      </div>
      <div class="w5 stack">
        <Card title={t`Written by this guide`}>
          {written.length === 0 ? <p class="soft">{t`Nothing yet.`}</p> : null}
          <ol class="small mono" data-test="guide-written">
            {written.map((line, i) => (
              <li key={i}>{line}</li>
            ))}
          </ol>
          <p class="small faint">{t`You can leave the guide and continue later. Settings has all of it.`}</p>
        </Card>
      </div>
    </div>
  );
}

function NumberField(props: { id: string; label: string; initial: string; hint?: string }): JSX.Element {
  const text = typed.value[props.id] ?? props.initial;
  return (
    <Field label={props.label} hint={props.hint}>
      <input
        class="input"
        inputmode="decimal"
        value={text}
        aria-invalid={text !== "" && measure(text) === null}
        data-test={`guide-${props.id}`}
        onInput={(event) => (typed.value = { ...typed.value, [props.id]: event.currentTarget.value })}
      />
    </Field>
  );
}

function read(id: string, initial: string): number {
  const value = measure(typed.value[id] ?? initial);
  if (value === null) throw new Error(t`${typed.value[id] ?? initial}: a number above 0 is needed`);
  return value;
}

const QUESTIONS = [
  { id: "travel", number: TRAVEL, label: msg`Travel, mm` },
  { id: "rate", number: RATE, label: msg`Fastest feed, mm/min` },
  { id: "acceleration", number: ACCELERATION, label: msg`Acceleration, mm/s²` },
] as const;

function Machine(): JSX.Element {
  const asks = useSignal<{ values: ReadonlyMap<number, string>; name: string } | null>(null);
  const ask = (values: ReadonlyMap<number, string>, name: string): void => void (asks.value = { values, name });
  const close = (): void => {
    asks.value = null;
    typed.value = {};
  };
  const apply = (): Promise<void> =>
    attempt(async () => {
      const values = new Map<number, string>();
      axes.value.forEach((axis, i) => {
        for (const { id, number } of QUESTIONS) values.set(number + i, String(read(`${id}-${axis}`, now(number + i))));
        const turn = typed.value[`turn-${axis}`];
        if (turn) values.set(STEPS + i, stepsPerMm(read("full", "200"), read("micro", "16"), read(`turn-${axis}`, "")).toFixed(3));
      });
      await write(values);
      typed.value = {};
      go(1);
    });
  return (
    <>
      {asks.value && (
        <ApplyDialog
          title={t`Write the settings of ${asks.value.name}?`}
          values={asks.value.values}
          onWritten={(number, before) => note(number, before, asks.peek()!.values.get(number)!)}
          onSent={(refused) => refused.length === 0 && go(1)}
          onClose={close}
        />
      )}
      <p>{t`Choose your machine, use its file, or answer the questions below. Measured values are better than those of a shop.`}</p>
      <div class="row">
        <MachineChoice onChoose={ask} />
        <FileButton accept=".toml,.txt" onFile={(file) => void attempt(async () => ask(await readSettings(await file.text()), file.name))} testId="guide-file">
          {t`Machine profile or settings file`}
        </FileButton>
      </div>
      <div class="row">
        <NumberField id="full" label={t`Full steps per turn`} initial="200" hint={t`1.8° motors have 200.`} />
        <NumberField id="micro" label={t`Microsteps`} initial="16" hint={t`Set at the driver.`} />
      </div>
      {axes.value.map((axis, i) => (
        <fieldset key={axis} class="row">
          <legend>{axis}</legend>
          {QUESTIONS.map(({ id, number, label }) => (
            <NumberField key={id} id={`${id}-${axis}`} label={tr(label)} initial={String(Number(now(number + i)))} />
          ))}
          <Field label={t`mm per turn`} hint={t`empty: stays ${Number(now(STEPS + i))} steps/mm`}>
            <input
              class="input"
              inputmode="decimal"
              value={typed.value[`turn-${axis}`] ?? ""}
              data-test={`guide-turn-${axis}`}
              onInput={(event) => (typed.value = { ...typed.value, [`turn-${axis}`]: event.currentTarget.value })}
            />
          </Field>
        </fieldset>
      ))}
      <p class="small faint">{t`A screw moves its lead per turn, a GT2 belt 2 mm for each tooth of the pulley.`}</p>
      <Button kind="primary" machine="sets" why={whyNoWrite()} onClick={() => void apply()} testId="guide-apply">
        {t`Write and continue`}
      </Button>
    </>
  );
}

/** Axis -> it was seen open and pressed. */
const seen = signal<Readonly<Record<string, number>>>({});
effect(() => {
  const pins = controller.status.value?.pins ?? "";
  if (!controller.connected.value || progress.value.step !== 1) return;
  const next = Object.fromEntries(axes.value.map((axis) => [axis, (seen.peek()[axis] ?? 0) | (pins.includes(axis) ? 2 : 1)]));
  if (axes.value.some((axis) => next[axis] !== seen.peek()[axis])) seen.value = next;
});

function Switches(): JSX.Element {
  const pins = controller.status.value?.pins ?? "";
  const all = axes.value.every((axis) => pins.includes(axis));
  const invert = (): Promise<void> =>
    attempt(async () => {
      await write(new Map([[LIMITS, now(LIMITS) === "1" ? "0" : "1"]]));
      seen.value = {};
    });
  return (
    <>
      <p>{t`Press each limit switch by hand, with the machine at rest. Axes without a switch can be left out.`}</p>
      <ul class="bare stack">
        {axes.value.map((axis) => (
          <li key={axis} class="row between" data-test={`guide-switch-${axis}`}>
            <b>{axis}</b>
            <span>{pins.includes(axis) ? t`pressed` : t`open`}</span>
            <span>{seen.value[axis] === 3 ? t`✓ works` : t`press and release it`}</span>
          </li>
        ))}
      </ul>
      {all && <Notice kind="warn" title={t`All switches read as pressed`} text={t`Then they close when they are free, or are not connected. Invert them if they are normally closed.`} />}
      <Button machine="sets" why={whyNoWrite()} onClick={() => void invert()} testId="guide-invert">
        {t`Invert the limit switches`}
      </Button>
    </>
  );
}

function Jogs({ axis, distance }: { axis: string; distance: number }): JSX.Element {
  return (
    <>
      {[-1, 1].map((sign) => (
        <Button key={sign} machine="starts" why={noMotion.value} onClick={() => void attempt(() => jogger.step({ [axis]: sign }, distance, FEED))} testId={`guide-jog-${axis}${sign < 0 ? "−" : "+"}`}>
          {`${axis} ${sign < 0 ? "−" : "+"}${distance}`}
        </Button>
      ))}
    </>
  );
}

function At({ axis }: { axis: number }): JSX.Element {
  return (
    <b class="mono" data-test={`guide-at-${AXES[axis]}`}>
      {(controller.workPosition.value[axis] ?? 0).toFixed(3)}
    </b>
  );
}

function Directions(): JSX.Element {
  const flip = (axis: number): Promise<void> => attempt(() => write(new Map([[DIRECTIONS, String(flipped(Number(now(DIRECTIONS)), axis))]])));
  return (
    <>
      <p>{t`Keep a hand at the e-stop. + moves the tool to the right (X), away from you (Y) and up (Z), seen from the work; a table moves the other way.`}</p>
      {axes.value.map((axis, i) => (
        <div key={axis} class="row">
          <Jogs axis={axis} distance={JOG_MM} />
          <At axis={i} />
          <Button machine="sets" why={whyNoWrite()} onClick={() => void flip(i)} testId={`guide-flip-${axis}`}>
            {t`${axis} moved the wrong way`}
          </Button>
        </div>
      ))}
    </>
  );
}

function Measure(): JSX.Element {
  const correct = (axis: string, i: number): Promise<void> =>
    attempt(async () => {
      const steps = corrected(Number(now(STEPS + i)), MEASURED_MM, read(`measured-${axis}`, ""));
      await write(new Map([[STEPS + i, steps.toFixed(3)]]));
      typed.value = { ...typed.value, [`measured-${axis}`]: "" };
    });
  return (
    <>
      <p>{t`Jog by ${MEASURED_MM} mm in one direction, first to take up the backlash, then to measure. Enter the distance of the second jog.`}</p>
      {axes.value.map((axis, i) => (
        <div key={axis} class="row">
          <Jogs axis={axis} distance={MEASURED_MM} />
          <NumberField id={`measured-${axis}`} label={t`${axis} measured, mm`} initial="" />
          <Button machine="sets" why={whyNoWrite()} onClick={() => void correct(axis, i)} testId={`guide-correct-${axis}`}>
            {t`Correct`}
          </Button>
        </div>
      ))}
    </>
  );
}

function Homing(): JSX.Element {
  const homes = now(HOMING) === "1";
  const flip = (axis: number): Promise<void> => attempt(() => write(new Map([[HOME_DIRECTIONS, String(flipped(Number(now(HOME_DIRECTIONS)), axis))]])));
  return (
    <>
      <p>{t`With switches, the controller finds its position at every start. Keep a hand at Reset: it must stop when a switch does not.`}</p>
      <div class="row">
        <Button why={whyNoWrite()} onClick={() => void attempt(() => write(new Map([[HOMING, homes ? "0" : "1"]])))} testId="guide-homing">
          {homes ? t`Do without homing` : t`Switch homing on`}
        </Button>
        {axes.value.map((axis, i) => (
          <Button key={axis} why={whyNoWrite()} onClick={() => void flip(i)}>
            {t`${axis} homes to ${Number(now(HOME_DIRECTIONS)) & (1 << i) ? "−" : "+"}`}
          </Button>
        ))}
      </div>
      <div class="row">
        <Button kind="primary" icon="home" machine="starts" why={noHoming.value || (!homes && t`Switch homing on first.`)} onClick={() => void attempt(() => controller.send("$H"))} testId="guide-home">
          {t`Home now`}
        </Button>
        <Button kind="danger" icon="stop" machine="stops" onClick={() => controller.reset()} testId="guide-reset">
          {t`Reset`}
        </Button>
      </div>
      {controller.homed.value !== "" && <Notice kind="good" title={t`Homed: ${controller.homed.value}`} text="" />}
    </>
  );
}

function FirstMove(): JSX.Element {
  return (
    <>
      <p>{t`Move each axis there and back. The position must show what the machine does.`}</p>
      {axes.value.map((axis, i) => (
        <div key={axis} class="row">
          <Jogs axis={axis} distance={JOG_MM} />
          <At axis={i} />
        </div>
      ))}
      <Notice kind="good" title={t`The machine is set up`} text={t`Export the settings (tab Settings), and keep the file. Next: load a job.`} />
    </>
  );
}
