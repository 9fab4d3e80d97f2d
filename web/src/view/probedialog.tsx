/** Probing dialogs: a picture, the numbers, a test of the probe before anything moves, the lines, the result and its undo. */
import { signal, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { attempt, controller, move, noMotion, standing } from "../app";
import { edgeAngle_deg, planProbe, probeProblem, runProbe, stepText, USUAL, type Cycle, type ProbeMachine, type ProbeValues, type Sign, type Step } from "../link/probing";
import { giveBack, lengthLine, modesOf } from "../link/modes";
import { setPosition, showsInches, undoZero, workSystem } from "../zeroing";
import { Button, Dialog, Field, Notice, Segments, StartStop } from "./parts";
import { ProbePicture } from "./probepicture";
import { msg, t, tr } from "../words";

const MM_PER_INCH = 25.4;

type NumberName = Exclude<keyof ProbeValues, "side" | "edge">;

const FIELDS: Readonly<Record<NumberName, string>> = {
  thickness_mm: msg`Thickness of the plate, mm`,
  wall_mm: msg`Wall of the plate, mm`,
  tool_mm: msg`Diameter of the tool, mm`,
  width_mm: msg`Width of the boss, mm`,
  out_mm: msg`Way out over the edge, mm`,
  down_mm: msg`Way down next to it, mm`,
  reach_mm: msg`Give up after, mm`,
  feed_mm_min: msg`Feed, mm/min`,
};

interface Wizard {
  cycle: Cycle;
  begin: string;
  fields: readonly NumberName[];
  /** Where a number means something else here. */
  labels?: Partial<Record<NumberName, string>>;
}

const WIZARDS: readonly Wizard[] = [
  {
    cycle: "plate",
    begin: msg`Put the plate on the work, and jog the tool to a few mm above it. Thickness 0: the bare work.`,
    fields: ["thickness_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "corner",
    begin:
      msg`Put the plate over the corner, and jog the tool to a few mm above it, inside of both edges. It touches the top, then each side.`,
    fields: ["thickness_mm", "wall_mm", "tool_mm", "out_mm", "down_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "hole",
    begin: msg`Jog the tool or the probe into the hole, below its edge and near its middle.`,
    fields: ["reach_mm", "feed_mm_min"],
  },
  {
    cycle: "boss",
    begin: msg`Jog the tool to above the middle of the boss, a few mm clear of it. The space around it must be free.`,
    fields: ["width_mm", "tool_mm", "out_mm", "down_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "edge",
    begin: msg`Jog the tool to a few mm next to the edge, below the top of the work.`,
    fields: ["tool_mm", "wall_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "rotation",
    begin: msg`Jog the tool to a few mm next to the edge, below the top of the work, at its left or front end. It touches there and once more along the edge. Nothing is set.`,
    fields: ["width_mm", "reach_mm", "feed_mm_min"],
    labels: { width_mm: msg`Distance along the edge, mm` },
  },
  {
    cycle: "length",
    begin: msg`Jog the tool to above the plate or the tool setter, which stays in one place. Measure the tool of the work zero first, as the reference, then each other tool.`,
    fields: ["down_mm", "reach_mm", "feed_mm_min"],
    labels: { down_mm: msg`Lift afterwards, mm` },
  },
];

const machine: ProbeMachine = {
  send: (line) => controller.send(line),
  rest: () => controller.rest(),
  move: (line) => move(line),
  machine_mm: () => standing.value.machine_mm,
  report_mm: () => (showsInches.value ? MM_PER_INCH : 1),
  isTouching: () => isTouching(),
  setPosition: (axis, value_mm) => setPosition({ [axis]: value_mm }, t`probed ${axis}`),
  setLength,
};

/** Machine position of Z at which a tool of length 0 touches; null: no tool was measured since the controller has started. */
const reference_mm = signal<number | null>(null);
const isReference = signal(true);
const broken = controller.onBreak;
controller.onBreak = (what) => {
  broken(what);
  reference_mm.value = null;
  isReference.value = true;
};

function length_mm(): number {
  return standing.value.offsets.get("TLO")?.[0] ?? 0;
}

/** Of the reference: the length in force stays. Of another tool: by how much earlier it touches. */
async function setLength(contact_mm: number): Promise<void> {
  if (isReference.value || reference_mm.value === null) {
    await controller.refresh("$#");
    reference_mm.value = contact_mm - length_mm();
    return;
  }
  await controller.send(lengthLine(contact_mm - reference_mm.value));
  await controller.refresh("$#");
}

function isTouching(): boolean {
  return controller.status.value?.pins.includes("P") ?? false;
}

/** What the program had before the cycle comes back, also when a reset has stopped the cycle; that of a parked job does by itself.
 * @param kept_mm  the tool length that is to be in force */
async function withModes(work: () => Promise<void>, kept_mm: () => number): Promise<void> {
  if (controller.operates.value) return work();
  await controller.refresh("$G");
  const kept = modesOf(controller);
  try {
    await work();
  } finally {
    await giveBack(controller, { ...kept, length_mm: kept_mm() });
  }
  return undefined;
}

/** Why a cycle may not continue; "": it may. */
function watch(): () => string {
  const [stops, others, parked] = [controller.stops, controller.othersStops, controller.operates.peek()];
  return () => {
    if (controller.stops !== stops) return t`Stopped by hand.`;
    if (controller.othersStops !== others) return t`Stopped by another client or at the machine`;
    if (controller.operates.peek() === parked && controller.commands.peek()) return "";
    return t`The job was resumed at the machine or by another client, so nothing follows.`;
  };
}

type Phase = "ready" | "running" | "stopping" | "done";

/** @param title  of the cycle, translated */
export function ProbeDialog({ cycle, title, onClose }: { cycle: Cycle; title: string; onClose: () => void }): JSX.Element {
  const wizard = WIZARDS.find((entry) => entry.cycle === cycle)!;
  const values = useSignal<ProbeValues>(USUAL);
  const phase = useSignal<Phase>("ready");
  const failed = useSignal("");
  const steps = planProbe(wizard.cycle, values.value);
  const problem = probeProblem(values.value);
  const tested = useProbeTest();
  const found = useSignal<ReadonlyMap<string, number>>(new Map());
  const before_mm = useSignal(0);
  const kept_mm = useSignal(0);
  const set = useSignal<readonly string[]>([]);
  const noting: ProbeMachine = {
    ...machine,
    setPosition: async (axis, value_mm) => {
      await machine.setPosition(axis, value_mm);
      set.value = [...set.value, axis];
    },
    setLength: async (contact_mm) => {
      await machine.setLength(contact_mm);
      kept_mm.value = length_mm();
    },
  };
  const undo = async (): Promise<void> => {
    for (const _ of set.value) await undoZero();
    set.value = [];
  };
  const go = async (): Promise<void> => {
    [phase.value, failed.value, set.value] = ["running", "", []];
    const ended = watch();
    const tell = (error: unknown): void => void (failed.value ||= ended() || (error instanceof Error ? error.message : String(error)));
    const run = async (): Promise<void> => {
      try {
        found.value = await runProbe(steps, noting, ended);
      } catch (error) {
        if (phase.peek() === "running") tell(error); // before the end of someone else's hold, which the modes wait for
        throw error;
      }
    };
    try {
      before_mm.value = kept_mm.value = length_mm();
      await withModes(run, () => kept_mm.value);
      phase.value = "done";
    } catch (error) {
      tell(error);
      phase.value = "ready";
    }
  };
  const stop = (): void => {
    if (phase.peek() !== "running") return;
    if (controller.stopMotion()) phase.value = "stopping";
  };
  const close = (): void => (stop(), onClose());
  const runs = phase.value === "running" || phase.value === "stopping";
  return (
    <Dialog
      title={t`Probe: ${title}`}
      onClose={close}
      actions={
        phase.value !== "done" && (
          <StartStop
            start={{ text: t`Probe`, why: !runs && (problem || noMotion.value || (tested ? "" : t`Test the probe first.`)), onClick: () => void go(), testId: "probe-start" }}
            stop={{ text: t`Stop`, onClick: stop, testId: "probe-stop" }}
            runs={runs}
            isStopping={phase.value === "stopping"}
          >
            <Button disabled={runs} onClick={close}>{t`Cancel`}</Button>
          </StartStop>
        )
      }
    >
      <div class="probe-top">
        <ProbePicture cycle={wizard.cycle} values={values.value} />
        <p class="small">{t`${tr(wizard.begin)} The machine need not be homed.`}</p>
      </div>
      {phase.value === "done" ? (
        <Result wizard={wizard} values={values.value} found={found.value} before_mm={before_mm.value} onClose={onClose} />
      ) : (
        <>
          <Sides wizard={wizard} values={values.value} onChange={(next) => (values.value = next)} />
          <div class="numbers">
            {wizard.fields.map((name) => (
              <Field key={name} label={tr(wizard.labels?.[name] ?? FIELDS[name])}>
                <input
                  class="input mono"
                  type="number"
                  step="any"
                  disabled={runs}
                  value={String(values.value[name])}
                  onInput={(event) => (values.value = { ...values.value, [name]: event.currentTarget.value.trim() === "" ? NaN : Number(event.currentTarget.value) })}
                  data-test={`probe-${name}`}
                />
              </Field>
            ))}
          </div>
          <ProbeTest tested={tested} />
          <details>
            <summary class="small">{t`Lines that it sends (${steps.length})`}</summary>
            <pre class="code" data-test="probe-lines">
              {steps.map(stepText).join("\n")}
            </pre>
          </details>
          {failed.value && (
            <Notice kind="bad" title={failed.value} text={setBefore(steps, set.value)}>
              {set.value.length > 0 && (
                <Button size="small" machine="sets" why={noMotion.value} onClick={() => void attempt(undo)} testId="probe-undo-part">
                  {t`Undo`}
                </Button>
              )}
            </Notice>
          )}
          {problem && <p class="small soft">{problem}</p>}
        </>
      )}
    </Dialog>
  );
}

/** Of a cycle that has ended before its end: what it has set, and what it has not. "": it sets no work zero. */
function setBefore(steps: readonly Step[], set: readonly string[]): string {
  const all = steps.filter((step) => step.kind === "set").map((step) => step.axis);
  if (all.length === 0) return "";
  const left = all.filter((axis) => !set.includes(axis)).sort().join(", ");
  if (set.length === 0) return t`The work zero is as before: nothing was set.`;
  return t`Work zero of ${[...set].sort().join(", ")} is set in ${workSystem.value} already; that of ${left} is as before.`;
}

/** Whether the probe has closed and opened again since this dialog is there. */
function useProbeTest(): boolean {
  const seen = useSignal(false);
  const tested = useSignal(false);
  const on = isTouching();
  useEffect(() => {
    if (on) seen.value = true;
    else if (seen.value) tested.value = true;
  }, [on]);
  return tested.value && !on;
}

function ProbeTest({ tested }: { tested: boolean }): JSX.Element {
  const on = isTouching();
  const text = on ? t`In contact: take the plate off the tool.` : tested ? t`The probe works.` : t`Touch the tool with the plate now, and take it away.`;
  return (
    <div class="row small" role="status" data-test="probe-test">
      <span class={`lamp ${on ? "on" : ""}`}>{t`Probe`}</span>
      <span class="grow">{text}</span>
    </div>
  );
}

function Sides({ wizard, values, onChange }: { wizard: Wizard; values: ProbeValues; onChange: (values: ProbeValues) => void }): JSX.Element | null {
  const isEdge = wizard.cycle === "edge" || wizard.cycle === "rotation";
  if (wizard.cycle === "length") return <LengthOf />;
  if (!isEdge && wizard.cycle !== "corner") return null;
  const side = (axis: "X" | "Y", names: readonly [string, string]): JSX.Element => (
    <Segments
      label={t`Side along ${axis}`}
      value={values.side[axis]}
      options={([-1, 1] as const).map((value, i) => ({ value, text: names[i]! }))}
      onChange={(value) => onChange({ ...values, side: { ...values.side, [axis]: value as Sign } })}
    />
  );
  return (
    <div class="row">
      {isEdge && (
        <Segments label={t`Axis`} value={values.edge} options={(["X", "Y"] as const).map((value) => ({ value, text: value }))} onChange={(edge) => onChange({ ...values, edge })} />
      )}
      {(!isEdge || values.edge === "X") && side("X", [t`Left`, t`Right`])}
      {(!isEdge || values.edge === "Y") && side("Y", [t`Front`, t`Rear`])}
    </div>
  );
}

function LengthOf(): JSX.Element {
  const options = [
    { value: 1, text: t`Reference tool` },
    { value: 0, text: t`Other tool` },
  ];
  return (
    <>
      <Segments label={t`Which tool`} value={Number(isReference.value || reference_mm.value === null)} options={options} onChange={(value) => (isReference.value = value === 1 || reference_mm.value === null)} />
      <p class="small soft">{reference_mm.value === null ? t`No reference yet: this tool becomes it.` : t`Its tool length is ${length_mm().toFixed(3)} mm now.`}</p>
    </>
  );
}

interface ResultProps {
  wizard: Wizard;
  values: ProbeValues;
  found: ReadonlyMap<string, number>;
  /** The tool length before the cycle. */
  before_mm: number;
  onClose: () => void;
}

/** A measured edge: the controller does not turn coordinates, so the work is turned. */
function Turned({ values, found, onClose }: ResultProps): JSX.Element {
  const angle = edgeAngle_deg(values, found);
  const off_mm = Math.abs(found.get("second")! - found.get("first")!);
  const [way, back] = angle > 0 ? [t`counter-clockwise`, t`clockwise`] : [t`clockwise`, t`counter-clockwise`];
  const text = t`Turn the work ${back}: ${off_mm.toFixed(2)} mm over ${values.width_mm} mm. Then measure it again, and set the work zero.`;
  return (
    <>
      <Notice kind="good" title={t`The edge is turned by ${Math.abs(angle).toFixed(3)}° ${way}`} text={off_mm < 0.005 ? t`It is straight.` : text} />
      <Button kind="primary" onClick={onClose} testId="probe-close">
        {t`Close`}
      </Button>
    </>
  );
}

function Length({ before_mm, onClose }: ResultProps): JSX.Element {
  const undone = useSignal(false);
  const undo = async (): Promise<void> => {
    await controller.send(before_mm === 0 ? "G49" : lengthLine(before_mm));
    await controller.refresh("$#");
    undone.value = true;
  };
  const wasReference = isReference.value;
  const next = (): void => {
    isReference.value = false;
    onClose();
  };
  const title = wasReference ? t`This tool is the reference` : t`The tool length is ${length_mm().toFixed(3)} mm`;
  return (
    <>
      <Notice kind={undone.value ? "info" : "good"} title={undone.value ? t`The tool length of before is back.` : title} text={wasReference ? t`Set the work zero of Z with it. Measure each other tool at the same place.` : undefined} />
      <div class="row">
        <Button kind="primary" onClick={next} testId="probe-close">
          {t`Close`}
        </Button>
        {!wasReference && !undone.value && (
          <Button why={noMotion.value} onClick={() => void attempt(undo)} testId="probe-undo">
            {t`Undo`}
          </Button>
        )}
      </div>
    </>
  );
}

function Result(props: ResultProps): JSX.Element {
  if (props.wizard.cycle === "rotation") return <Turned {...props} />;
  return props.wizard.cycle === "length" ? <Length {...props} /> : <ZeroSet {...props} />;
}

function ZeroSet({ wizard, onClose }: ResultProps): JSX.Element {
  const undone = useSignal("");
  const sets = planProbe(wizard.cycle, USUAL).filter((step) => step.kind === "set");
  const axes = wizard.cycle === "edge" ? t`the axis` : sets.map((step) => step.axis).sort().join(", ");
  const place = [...controller.workPosition.value.slice(0, 3)].map((value, i) => `${"XYZ"[i]} ${value.toFixed(3)}`).join(", ");
  const undo = async (): Promise<void> => {
    for (const _ of sets) await undoZero();
    undone.value = t`The work zero of before is back.`;
  };
  return (
    <>
      <Notice kind={undone.value ? "info" : "good"} title={undone.value || t`Work zero of ${axes} is set in ${workSystem.value}`} text={t`The tool is at ${place}.`} />
      <div class="row">
        <Button kind="primary" onClick={onClose} testId="probe-close">
          {t`Close`}
        </Button>
        {!undone.value && (
          <Button why={noMotion.value} onClick={() => void undo()} testId="probe-undo">
            {t`Undo`}
          </Button>
        )}
      </div>
    </>
  );
}
