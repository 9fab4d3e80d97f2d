/** Probing dialogs: a picture, the numbers, a test of the probe before anything moves, the lines, the result and its undo. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { controller, noMotion, standing } from "../app";
import { planProbe, probeProblem, runProbe, stepText, USUAL, type Cycle, type ProbeMachine, type ProbeValues, type Sign } from "../link/probing";
import { setPosition, showsInches, undoZero, workSystem } from "../zeroing";
import { Button, Card, Dialog, Field, Notice, Segments } from "./parts";
import { ProbePicture } from "./probepicture";

const MM_PER_INCH = 25.4;

type NumberName = Exclude<keyof ProbeValues, "side" | "edge">;

const FIELDS: Readonly<Record<NumberName, string>> = {
  thickness_mm: "Thickness of the plate, mm",
  wall_mm: "Wall of the plate, mm",
  tool_mm: "Diameter of the tool, mm",
  width_mm: "Width of the boss, mm",
  out_mm: "Way out over the edge, mm",
  down_mm: "Way down next to it, mm",
  reach_mm: "Give up after, mm",
  feed_mm_min: "Feed, mm/min",
};

interface Wizard {
  cycle: Cycle;
  title: string;
  begin: string;
  fields: readonly NumberName[];
}

const WIZARDS: readonly Wizard[] = [
  {
    cycle: "plate",
    title: "Z plate",
    begin: "Put the plate on the work, and jog the tool to a few mm above it. Thickness 0: the bare work.",
    fields: ["thickness_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "corner",
    title: "Corner",
    begin:
      "Put the plate over the corner, and jog the tool to a few mm above it, inside of both edges. It touches the top, then each side.",
    fields: ["thickness_mm", "wall_mm", "tool_mm", "out_mm", "down_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "hole",
    title: "Centre of a hole",
    begin: "Jog the tool or the probe into the hole, below its edge and near its middle.",
    fields: ["reach_mm", "feed_mm_min"],
  },
  {
    cycle: "boss",
    title: "Centre of a boss",
    begin: "Jog the tool to above the middle of the boss, a few mm clear of it. The space around it must be free.",
    fields: ["width_mm", "tool_mm", "out_mm", "down_mm", "reach_mm", "feed_mm_min"],
  },
  {
    cycle: "edge",
    title: "Edge",
    begin: "Jog the tool to a few mm next to the edge, below the top of the work.",
    fields: ["tool_mm", "wall_mm", "reach_mm", "feed_mm_min"],
  },
];

export function ProbeCard(): JSX.Element {
  const open = useSignal<Wizard | null>(null);
  return (
    <Card title="Probe">
      <div class="row">
        {WIZARDS.map((wizard) => (
          <Button key={wizard.cycle} why={noMotion.value} onClick={() => (open.value = wizard)} testId={`probe-${wizard.cycle}`}>
            {wizard.title}
          </Button>
        ))}
      </div>
      {open.value && <ProbeDialog wizard={open.value} onClose={() => (open.value = null)} />}
    </Card>
  );
}

const machine: ProbeMachine = {
  send: (line) => controller.send(line),
  rest: () => controller.rest(),
  machine_mm: () => standing.value.machine_mm,
  report_mm: () => (showsInches.value ? MM_PER_INCH : 1),
  isTouching: () => isTouching(),
  setPosition: (axis, value_mm) => setPosition({ [axis]: value_mm }, `probed ${axis}`),
};

function isTouching(): boolean {
  return controller.status.value?.pins.includes("P") ?? false;
}

/** Of the program, as they were before the cycle; those of a parked job come back by themselves. */
async function withModes(work: () => Promise<void>): Promise<void> {
  if (controller.operates.value) return work();
  await controller.refresh("$G");
  const words = controller.modes.value.split(" ").filter((word) => /^(G9[01]|G2[01]|G9[345])$/.test(word));
  const feed = controller.modes.value.split(" ").filter((word) => /^F[\d.]+$/.test(word) && words.includes("G94"));
  try {
    await work();
  } finally {
    if (controller.state.value === "Idle") await controller.send(["G0", ...words, ...feed].join(""));
  }
  return undefined;
}

type Phase = "ready" | "running" | "stopping" | "done";

function ProbeDialog({ wizard, onClose }: { wizard: Wizard; onClose: () => void }): JSX.Element {
  const values = useSignal<ProbeValues>(USUAL);
  const phase = useSignal<Phase>("ready");
  const failed = useSignal("");
  const steps = planProbe(wizard.cycle, values.value);
  const problem = probeProblem(values.value);
  const tested = useProbeTest();
  const go = async (): Promise<void> => {
    [phase.value, failed.value] = ["running", ""];
    try {
      await withModes(async () => void (await runProbe(steps, machine, () => phase.peek() === "stopping")));
      phase.value = "done";
    } catch (error) {
      failed.value = phase.peek() === "stopping" ? "Stopped by hand." : error instanceof Error ? error.message : String(error);
      phase.value = "ready";
    }
  };
  const stop = (): void => {
    if (phase.peek() !== "running") return;
    phase.value = "stopping";
    controller.stopMotion();
  };
  const close = (): void => (stop(), onClose());
  const runs = phase.value === "running" || phase.value === "stopping";
  return (
    <Dialog title={`Probe: ${wizard.title}`} onClose={close}>
      <div class="probe-top">
        <ProbePicture cycle={wizard.cycle} values={values.value} />
        <p class="small">{wizard.begin} The machine need not be homed.</p>
      </div>
      {phase.value === "done" ? (
        <Result wizard={wizard} onClose={onClose} />
      ) : (
        <>
          <Sides wizard={wizard} values={values.value} onChange={(next) => (values.value = next)} />
          <div class="numbers">
            {wizard.fields.map((name) => (
              <Field key={name} label={FIELDS[name]}>
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
            <summary class="small">Lines that it sends ({steps.length})</summary>
            <pre class="code" data-test="probe-lines">
              {steps.map(stepText).join("\n")}
            </pre>
          </details>
          {failed.value && <Notice kind="bad" title={failed.value} />}
          <div class="row">
            {runs ? (
              <Button kind="danger" icon="stop" disabled={phase.value === "stopping"} onClick={stop} testId="probe-stop">
                Stop
              </Button>
            ) : (
              <Button kind="primary" icon="play" why={problem || noMotion.value || (tested ? "" : "Test the probe first.")} onClick={() => void go()} testId="probe-start">
                Probe
              </Button>
            )}
            {!runs && <Button onClick={close}>Cancel</Button>}
            {problem && <span class="small soft">{problem}</span>}
          </div>
        </>
      )}
    </Dialog>
  );
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
  const text = on ? "In contact: take the plate off the tool." : tested ? "The probe works." : "Touch the tool with the plate now, and take it away.";
  return (
    <div class="row small" role="status" data-test="probe-test">
      <span class={`lamp ${on ? "on" : ""}`}>Probe</span>
      <span class="grow">{text}</span>
    </div>
  );
}

function Sides({ wizard, values, onChange }: { wizard: Wizard; values: ProbeValues; onChange: (values: ProbeValues) => void }): JSX.Element | null {
  const isEdge = wizard.cycle === "edge";
  if (!isEdge && wizard.cycle !== "corner") return null;
  const side = (axis: "X" | "Y", names: readonly [string, string]): JSX.Element => (
    <Segments
      label={`Side along ${axis}`}
      value={values.side[axis]}
      options={([-1, 1] as const).map((value, i) => ({ value, text: names[i]! }))}
      onChange={(value) => onChange({ ...values, side: { ...values.side, [axis]: value as Sign } })}
    />
  );
  return (
    <div class="row">
      {isEdge && (
        <Segments label="Axis" value={values.edge} options={(["X", "Y"] as const).map((value) => ({ value, text: value }))} onChange={(edge) => onChange({ ...values, edge })} />
      )}
      {(!isEdge || values.edge === "X") && side("X", ["Left", "Right"])}
      {(!isEdge || values.edge === "Y") && side("Y", ["Front", "Back"])}
    </div>
  );
}

function Result({ wizard, onClose }: { wizard: Wizard; onClose: () => void }): JSX.Element {
  const undone = useSignal("");
  const sets = planProbe(wizard.cycle, USUAL).filter((step) => step.kind === "set");
  const axes = wizard.cycle === "edge" ? "the axis" : sets.map((step) => step.axis).sort().join(", ");
  const place = [...controller.workPosition.value.slice(0, 3)].map((value, i) => `${"XYZ"[i]} ${value.toFixed(3)}`).join(", ");
  const undo = async (): Promise<void> => {
    for (const _ of sets) await undoZero();
    undone.value = "The work zero of before is back.";
  };
  return (
    <>
      <Notice kind={undone.value ? "info" : "good"} title={undone.value || `Work zero of ${axes} is set in ${workSystem.value}`} text={`The tool is at ${place}.`} />
      <div class="row">
        <Button kind="primary" onClick={onClose} testId="probe-close">
          Close
        </Button>
        {!undone.value && (
          <Button why={noMotion.value} onClick={() => void undo()} testId="probe-undo">
            Undo
          </Button>
        )}
      </div>
    </>
  );
}
