/** Where the machine is, and moving it by hand. */
import { signal, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useLayoutEffect } from "preact/hooks";
import { attempt, controller, job, noHoming, noLines, noMotion, standing } from "../app";
import { Jogger, type Direction } from "../link/jog";
import { planZero, type ZeroFacts } from "../link/zero";
import { AXES, type RealtimeName } from "../tables";
import { Button, Card, Check, Dialog, Field, Icon, Progress, Segments, type IconName } from "./parts";

const jogger = new Jogger(controller);
const STEPS = [0.01, 0.1, 1, 10, 100] as const;
/** While held. */
const HELD = 0;
const WORK_SYSTEMS = ["G54", "G55", "G56", "G57", "G58", "G59"];
const FEED_MIN = 10;
const FEED_USUAL = 1000;

const distance = signal<number>(1);
const feed = signal<number>(FEED_USUAL);

export function ControlTab(): JSX.Element {
  return (
    <div class="columns">
      <div class="w7 stack">
        <PositionCard />
        <JobCard />
      </div>
      <div class="w5 stack">
        <JogCard />
        <OverrideCard />
      </div>
    </div>
  );
}

// ---- position ----

function PositionCard(): JSX.Element {
  const axes = [...AXES.slice(0, controller.axisCount.value || 3)];
  const asks = useSignal(false);
  const zeroAll = `G10L20P0${axes.map((axis) => `${axis}0`).join("")}`;
  return (
    <Card title="Position" tools={<WorkSystem />}>
      <div class="dro">
        {axes.map((axis, i) => (
          <Axis key={axis} axis={axis} index={i} />
        ))}
      </div>
      <div class="row">
        <Button icon="home" why={noHoming.value} onClick={() => void attempt(() => controller.send("$H"))} testId="home">
          Home
        </Button>
        <Button why={noMotion.value} onClick={() => void attempt(() => controller.send(zeroAll))}>
          Zero all
        </Button>
        <Button
          why={noMotion.value}
          title="Raise Z, then move X and Y to work zero"
          onClick={() => void attempt(async () => (asks.value = await goToZero(null)))}
          testId="go-to-zero"
        >
          Go to zero
        </Button>
      </div>
      {controller.connected.value && noMotion.value && (
        <p class="small soft" data-test="why-not">
          {noMotion.value}
        </p>
      )}
      {asks.value && <LiftDialog onClose={() => (asks.value = false)} />}
      <Lamps />
    </Card>
  );
}

const SAME_HEIGHT_MM = 0.05;

function zeroFacts(): ZeroFacts {
  const { machine_mm, origin_mm, homed, settings } = standing.value;
  return { axisCount: controller.axisCount.value, homed, machine_mm, offset_mm: origin_mm, settings };
}

/** Each line when the one before has been moved completely. @returns whether someone has to say first how far Z lifts */
async function goToZero(lift_mm: number | null): Promise<boolean> {
  const plan = planZero(zeroFacts(), lift_mm);
  if (plan.kind === "ask") return true;
  if (plan.kind === "refuse") throw new Error(plan.why);
  for (const [i, line] of plan.lines.entries()) {
    if (i > 0 && plan.z_mm !== null && Math.abs(zeroFacts().machine_mm[2]! - plan.z_mm) > SAME_HEIGHT_MM)
      throw new Error("Z did not reach its height, so X and Y do not move.");
    await controller.send(line);
    await controller.rest();
  }
  return false;
}

const LIFT_USUAL_MM = 5;

/** A machine that was not homed: no one but the person in front of it can say how far Z can go up. */
function LiftDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const lift = useSignal(String(LIFT_USUAL_MM));
  const lift_mm = lift.value.trim() === "" ? NaN : Number(lift.value);
  const go = (): void => {
    onClose();
    void attempt(() => goToZero(lift_mm));
  };
  return (
    <Dialog title="How far can Z lift?" onClose={onClose}>
      <p class="soft">
        The machine was not homed while this page was connected, so the free travel above Z is unknown. Z lifts by this distance from
        where it is now, then X and Y move straight to work zero at that height.
      </p>
      <Field label="Lift Z by, mm" hint="0: Z does not move.">
        <input class="input short mono" type="number" min={0} step={1} value={lift.value} onInput={(event) => (lift.value = event.currentTarget.value)} data-test="lift" />
      </Field>
      <div class="row">
        <Button kind="primary" why={noMotion.value} disabled={!(lift_mm >= 0)} onClick={go} testId="lift-go">
          Lift and move
        </Button>
        <Button onClick={onClose}>Cancel</Button>
      </div>
    </Dialog>
  );
}

function Axis({ axis, index }: { axis: string; index: number }): JSX.Element {
  const work = controller.workPosition.value[index];
  const machine = controller.machinePosition.value[index];
  return (
    <div class="dro-axis">
      <span class="dro-letter">{axis}</span>
      <span class="dro-work mono" data-test={`work-${axis}`}>
        {work === undefined ? "–" : fixed(work)}
      </span>
      <span class="dro-machine mono" title="Machine position">
        {machine === undefined ? "" : fixed(machine)}
      </span>
      <Button
        size="small"
        label={`Zero ${axis}`}
        why={noMotion.value}
        onClick={() => void attempt(() => controller.send(`G10L20P0${axis}0`))}
      >
        Zero
      </Button>
    </div>
  );
}

function fixed(value: number): string {
  return (Object.is(value, -0) ? 0 : value).toFixed(3);
}

function WorkSystem(): JSX.Element {
  const current = controller.modes.value.split(" ").find((word) => WORK_SYSTEMS.includes(word)) ?? "G54";
  return (
    <label class="row small soft">
      Work system
      <select
        class="input short"
        value={current}
        disabled={noMotion.value !== ""}
        title={noMotion.value || undefined}
        onChange={(event) => {
          const chosen = event.currentTarget.value;
          void attempt(async () => {
            await controller.send(chosen);
            await controller.send("$G");
          });
        }}
      >
        {WORK_SYSTEMS.map((name) => (
          <option key={name}>{name}</option>
        ))}
      </select>
    </label>
  );
}

const LAMPS: readonly [string, string][] = [
  ["P", "Probe"],
  ["D", "Door"],
  ["H", "Hold input"],
  ["R", "Reset input"],
  ["S", "Start input"],
  ["T", "M1 stops"],
];

function Lamps(): JSX.Element {
  const pins = controller.status.value?.pins ?? "";
  const axes = [...AXES.slice(0, controller.axisCount.value)];
  const feedNow = controller.status.value?.feed ?? 0;
  const speed = controller.status.value?.speed ?? 0;
  return (
    <div class="stack">
      <div class="lamps" aria-label="Inputs">
        {axes.map((axis) => (
          <span key={axis} class={`lamp ${pins.includes(axis) ? "on" : ""}`}>
            {axis} limit
          </span>
        ))}
        {LAMPS.map(([letter, name]) => (
          <span key={letter} class={`lamp ${pins.includes(letter) ? "on" : ""}`}>
            {name}
          </span>
        ))}
      </div>
      <dl class="facts">
        <dt>Feed</dt>
        <dd class="mono">{feedNow.toFixed(0)} mm/min</dd>
        <dt>Spindle</dt>
        <dd class="mono">{speed.toFixed(0)} rpm</dd>
        <dt>Modes</dt>
        <dd class="mono small">{controller.modes.value || "–"}</dd>
      </dl>
    </div>
  );
}

// ---- job, in short ----

function JobCard(): JSX.Element | null {
  const program = job.program.value;
  if (!program) return null;
  const share = job.total ? job.executed.value / job.total : 0;
  return (
    <Card title={`Job: ${program.name}`}>
      <Progress value={share} label="Job" />
      <p class="soft small">
        {job.state.value}, {job.executed.value} of {job.total} lines
      </p>
    </Card>
  );
}

// ---- jog ----

interface JogKey {
  label: string;
  icon?: IconName;
  /** Key of a keyboard, KeyboardEvent.key. */
  key?: string;
  direction: Direction;
}

/** Rows of four; null: nothing there. */
const PAD: readonly (JogKey | null)[] = [
  null,
  { label: "Y+", icon: "up", key: "ArrowUp", direction: { Y: 1 } },
  null,
  { label: "Z+", icon: "up", key: "PageUp", direction: { Z: 1 } },
  { label: "X−", icon: "left", key: "ArrowLeft", direction: { X: -1 } },
  null,
  { label: "X+", icon: "right", key: "ArrowRight", direction: { X: 1 } },
  null,
  null,
  { label: "Y−", icon: "down", key: "ArrowDown", direction: { Y: -1 } },
  null,
  { label: "Z−", icon: "down", key: "PageDown", direction: { Z: -1 } },
];
const TURNING: readonly JogKey[] = ["A", "B", "C"].flatMap((axis) => [
  { label: `${axis}−`, direction: { [axis]: -1 } },
  { label: `${axis}+`, direction: { [axis]: 1 } },
]);

function canJog(): boolean {
  return noLines.value === "" && ["Idle", "Jog"].includes(controller.state.value);
}

function press(direction: Direction): void {
  if (!canJog()) return;
  if (distance.value === HELD) jogger.begin(direction, feed.value);
  else void attempt(() => jogger.step(direction, distance.value, feed.value));
}

function JogCard(): JSX.Element {
  const keyboard = useSignal(false);
  useKeyboard(keyboard.value);
  const has = (key: JogKey): boolean => Object.keys(key.direction).every((axis) => AXES.indexOf(axis) < (controller.axisCount.value || 3));
  const turning = TURNING.filter(has);
  return (
    <Card title="Jog" tools={<Check label="Keyboard" checked={keyboard.value} onChange={(on) => (keyboard.value = on)} />}>
      <div class="jog">{PAD.map((key, i) => (key && has(key) ? <JogButton key={key.label} jog={key} /> : <span key={i} />))}</div>
      {turning.length > 0 && (
        <div class="jog turning">
          {turning.map((key) => (
            <JogButton key={key.label} jog={key} />
          ))}
        </div>
      )}
      <div class="row between">
        <Segments
          label="Distance, mm"
          value={distance.value}
          options={[...STEPS.map((step) => ({ value: step as number, text: String(step) })), { value: HELD, text: "while held" }]}
          onChange={(value) => (distance.value = value)}
        />
        <label class="row small soft">
          Feed
          <input
            class="input short mono"
            type="number"
            min={FEED_MIN}
            step={100}
            value={feed.value}
            onChange={(event) => (feed.value = Math.max(FEED_MIN, Number(event.currentTarget.value) || FEED_USUAL))}
          />
          mm/min
        </label>
      </div>
      {keyboard.value && <p class="small soft">Arrow keys jog X and Y, Page Up and Page Down jog Z. Escape stops.</p>}
    </Card>
  );
}

function JogButton({ jog }: { jog: JogKey }): JSX.Element {
  return (
    <button
      type="button"
      class="button"
      aria-label={`Jog ${jog.label}`}
      data-test={`jog-${jog.label}`}
      disabled={!canJog()}
      title={canJog() ? undefined : noLines.value || noMotion.value}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        press(jog.direction);
      }}
      onPointerUp={() => jogger.end()}
      onPointerCancel={() => jogger.end()}
      onLostPointerCapture={() => jogger.end()}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if ((event.key === "Enter" || event.key === " ") && !event.repeat) press(jog.direction);
      }}
      onKeyUp={() => jogger.end()}
      onBlur={() => jogger.end()}
    >
      {jog.icon && <Icon name={jog.icon} />}
      {jog.label}
    </button>
  );
}

/** Keys jog while this is on and no field has the focus; a window that loses the focus lets go. */
function useKeyboard(on: boolean): void {
  useLayoutEffect(() => {
    if (!on) return undefined;
    const down = (event: KeyboardEvent): void => {
      if (event.key === "Escape") controller.realtime("JOG_CANCEL");
      const key = PAD.find((entry) => entry?.key === event.key);
      const typing = event.target instanceof HTMLElement && event.target.closest("input:not([type=checkbox]), select, textarea, [role=tab]");
      if (!key || typing || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      if (!event.repeat) press(key.direction);
    };
    const end = (): void => jogger.end();
    window.addEventListener("keydown", down);
    window.addEventListener("keyup", end);
    window.addEventListener("blur", end);
    document.addEventListener("visibilitychange", end);
    return () => {
      window.removeEventListener("keydown", down);
      window.removeEventListener("keyup", end);
      window.removeEventListener("blur", end);
      document.removeEventListener("visibilitychange", end);
      end();
    };
  }, [on]);
}

// ---- overrides ----

interface Step {
  text: string;
  byte: RealtimeName;
  label: string;
}

function steps(name: "FEED" | "SPINDLE"): readonly (Step | null)[] {
  const what = name === "FEED" ? "Feed" : "Spindle";
  return [
    { text: "−10", byte: `${name}_MINUS_10`, label: `${what} 10 % less` },
    { text: "−1", byte: `${name}_MINUS_1`, label: `${what} 1 % less` },
    null,
    { text: "+1", byte: `${name}_PLUS_1`, label: `${what} 1 % more` },
    { text: "+10", byte: `${name}_PLUS_10`, label: `${what} 10 % more` },
    { text: "100", byte: `${name}_100`, label: `${what} 100 %` },
  ];
}

function OverrideCard(): JSX.Element {
  const [feedPct, rapidPct, spindlePct] = controller.overrides.value;
  const rapids: readonly [string, RealtimeName][] = [
    ["25", "RAPID_25"],
    ["50", "RAPID_50"],
    ["100", "RAPID_100"],
  ];
  return (
    <Card title="Overrides">
      <OverrideRow title="Feed" percent={feedPct} steps={steps("FEED")} test="feed" />
      <div class="override">
        <span class="soft">Rapid</span>
        <div class="row">
          <span class="value mono">{rapidPct} %</span>
          {rapids.map(([text, byte]) => (
            <Button key={text} size="small" label={`Rapids ${text} %`} disabled={!controller.commands.value} onClick={() => controller.realtime(byte)}>
              {text}
            </Button>
          ))}
        </div>
      </div>
      <OverrideRow title="Spindle" percent={spindlePct} steps={steps("SPINDLE")} test="spindle" />
    </Card>
  );
}

function OverrideRow(props: { title: string; percent: number; steps: readonly (Step | null)[]; test: string }): JSX.Element {
  return (
    <div class="override">
      <span class="soft">{props.title}</span>
      <div class="row">
        {props.steps.map((step) =>
          step ? (
            <Button
              key={step.byte}
              size="small"
              label={step.label}
              disabled={!controller.commands.value}
              onClick={() => controller.realtime(step.byte)}
            >
              {step.text}
            </Button>
          ) : (
            <span key="value" class="value mono" data-test={`override-${props.test}`}>
              {props.percent} %
            </span>
          ),
        )}
      </div>
    </div>
  );
}
