/** Where the machine is, and moving it by hand. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useLayoutEffect } from "preact/hooks";
import { attempt, axesShown, controller, fail, failure, job, noLines, noMotion } from "../app";
import { combined, heldFeed, Jogger, type Direction } from "../link/jog";
import { LinkError } from "../link/transport";
import { AXES, settingNumber, type RealtimeName } from "../tables";
import { Button, Card, Check, Icon, Progress, Segments, type IconName } from "./parts";
import { isLarge, PositionCard } from "./position";
import { ProbeCard } from "./probe";
import { useAway } from "./fire";
import { Shortcuts } from "./shortcuts";
import type { JobState } from "../job/runner";
import { msg, t, tr } from "../words";

const jogger = new Jogger(controller, (why, hint) => fail(new LinkError(why, hint)));
const STEPS = [0.01, 0.1, 1, 10, 100] as const;
/** While held. */
const HELD = 0;
const FEED_MIN = 10;
const FEED_USUAL = 1000;
/** X, Y and Z. */
const LINEAR = 3;
/** Of a machine that has not reported how fast it is. */
const FEED_MOST = 100_000;
const MAX_RATE = settingNumber("max_rate_mm_min");

const distance = signal<number>(1);
const feed = signal<number>(FEED_USUAL);
/** Keys jog while the pad is shown: the choice outlives a look at another tab. */
const keyboard = signal(false);
/** What holds a jog when it is no button. */
const KEYS = "keys";

export function ControlTab(): JSX.Element {
  return (
    <div class="columns control">
      <div class={`${isLarge.value ? "w12" : "w7"} stack`}>
        <PositionCard />
        <ProbeCard />
        <JobCard />
      </div>
      <div class={`${isLarge.value ? "w12" : "w5"} stack`}>
        <JogCard />
        <Shortcuts />
        <OverrideCard />
      </div>
    </div>
  );
}

// ---- job, in short ----

const JOB_STATES: Record<JobState, string> = {
  none: msg`none`,
  ready: msg`ready`,
  running: msg`running`,
  stopping: msg`stopping`,
  done: msg`done`,
  stopped: msg`stopped`,
  failed: msg`failed`,
  lost: msg`lost`,
  left: msg`left`,
  taken: msg`taken by another client`,
  restarted: msg`lost by a restart`,
};

function JobCard(): JSX.Element | null {
  const program = job.program.value;
  if (!program) return null;
  const share = job.total ? job.executed.value / job.total : 0;
  return (
    <Card title={t`Job: ${program.name}`}>
      <Progress value={share} label={t`Job`} />
      <p class="soft small">
        {t`${tr(JOB_STATES[job.state.value])}, ${job.executed.value} of ${job.total} lines`}
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
  return noLines.value === "" && (controller.operates.value || ["Idle", "Jog"].includes(controller.state.value));
}

function press(direction: Direction, by: string): void {
  if (!canJog()) return;
  if (distance.value === HELD) hold(direction, by);
  else void attempt(() => jogger.step(direction, distance.value, feed.value));
}

function hold(direction: Direction, by: string): void {
  failure.value = null;
  jogger.begin(direction, heldFeed(direction, feed.value, controller.settings.value), by);
}

function fastest(): number {
  const rates = [...AXES].slice(0, LINEAR).map((_, i) => Number(controller.settings.value.get(MAX_RATE + i) ?? 0));
  return Math.max(...rates) || FEED_MOST;
}

function typeFeed(input: HTMLInputElement): void {
  feed.value = Math.min(fastest(), Math.max(FEED_MIN, Number(input.value) || FEED_USUAL));
  input.value = String(feed.value); // also when it is the one of before
}

function JogCard(): JSX.Element {
  useKeyboard(keyboard.value);
  const can = canJog();
  useEffect(() => void (can || jogger.end()), [can]);
  useAway(() => jogger.end());
  const has = (key: JogKey): boolean => Object.keys(key.direction).every((axis) => AXES.indexOf(axis) < axesShown.value);
  const turning = TURNING.filter(has);
  return (
    <Card title={t`Jog`} tools={<Check label={t`Keyboard`} checked={keyboard.value} onChange={(on) => (keyboard.value = on)} />}>
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
          label={t`Distance, mm`}
          value={distance.value}
          options={[...STEPS.map((step) => ({ value: step as number, text: String(step) })), { value: HELD, text: t`while held` }]}
          onChange={(value) => (distance.value = value)}
        />
        <label class="row small soft">
          {t`Feed`}
          <input
            class="input short mono"
            type="number"
            min={FEED_MIN}
            max={fastest()}
            step={100}
            value={feed.value}
            onChange={(event) => typeFeed(event.currentTarget)}
            data-test="jog-feed"
          />
          {t`mm/min`}
        </label>
      </div>
      <p class={`small soft hide-narrow ${keyboard.value ? "" : "unseen"}`}>
        {t`Arrow keys jog X and Y, two held together diagonally. Page Up and Page Down jog Z. Escape stops.`}
      </p>
    </Card>
  );
}

function JogButton({ jog }: { jog: JogKey }): JSX.Element {
  const end = (): void => jogger.end(jog.label);
  useEffect(() => end, []);
  return (
    <button
      type="button"
      class="button"
      aria-label={t`Jog ${jog.label}`}
      data-machine="starts"
      data-test={`jog-${jog.label}`}
      disabled={!canJog()}
      title={canJog() ? undefined : noLines.value || noMotion.value}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        press(jog.direction, jog.label);
      }}
      onPointerUp={end}
      onPointerCancel={end}
      onLostPointerCapture={end}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if ((event.key === "Enter" || event.key === " ") && !event.repeat) press(jog.direction, jog.label);
      }}
      onKeyUp={end}
      onBlur={end}
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
    const keys = new Map<string, Direction>();
    const jogKeys = (): void => {
      const direction = combined(keys.values());
      if (Object.keys(direction).length > 0 && canJog()) hold(direction, KEYS);
      else jogger.end(KEYS);
    };
    const down = (event: KeyboardEvent): void => {
      if (event.key === "Escape") controller.realtime("JOG_CANCEL");
      if (document.querySelector("dialog[open]")) return; // its keys are not the machine's
      const key = PAD.find((entry) => entry?.key === event.key);
      const typing = event.target instanceof HTMLElement && event.target.closest("input:not([type=checkbox]), select, textarea, [role=tab]");
      if (!key || typing || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      if (event.repeat) return;
      if (distance.value !== HELD) return press(key.direction, KEYS);
      if (!jogger.isHeld(KEYS)) keys.clear(); // stopped meanwhile: what is still down jogs when it is pressed again
      keys.set(event.key, key.direction);
      jogKeys();
    };
    const up = (event: KeyboardEvent): void => {
      if (!keys.delete(event.key)) return;
      if (jogger.isHeld(KEYS)) jogKeys();
      else keys.clear(); // stopped: letting go of one key does not start the other one again
    };
    const end = (): void => {
      keys.clear();
      jogger.end(KEYS);
    };
    window.addEventListener("keydown", down);
    window.addEventListener("keyup", up);
    window.addEventListener("blur", end);
    document.addEventListener("visibilitychange", end);
    return () => {
      window.removeEventListener("keydown", down);
      window.removeEventListener("keyup", up);
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
  const what = name === "FEED" ? t`Feed` : t`Spindle`;
  return [
    { text: "−10", byte: `${name}_MINUS_10`, label: t`${what} 10 % less` },
    { text: "−1", byte: `${name}_MINUS_1`, label: t`${what} 1 % less` },
    null,
    { text: "+1", byte: `${name}_PLUS_1`, label: t`${what} 1 % more` },
    { text: "+10", byte: `${name}_PLUS_10`, label: t`${what} 10 % more` },
    { text: "100", byte: `${name}_100`, label: `${what} 100 %` },
  ];
}

export function OverrideCard(): JSX.Element {
  const [feedPct, rapidPct, spindlePct] = controller.overrides.value;
  const rapids: readonly [string, RealtimeName][] = [
    ["25", "RAPID_25"],
    ["50", "RAPID_50"],
    ["100", "RAPID_100"],
  ];
  return (
    <Card title={t`Overrides`}>
      <OverrideRow title={t`Feed`} percent={feedPct} steps={steps("FEED")} test="feed" />
      <div class="override">
        <span class="soft">{t`Rapid`}</span>
        <div class="row">
          <span class="value mono">{rapidPct} %</span>
          {rapids.map(([text, byte]) => (
            <Button key={text} size="small" label={t`Rapids ${text} %`} disabled={!controller.commands.value} onClick={() => controller.realtime(byte)}>
              {text}
            </Button>
          ))}
        </div>
      </div>
      <OverrideRow title={t`Spindle`} percent={spindlePct} steps={steps("SPINDLE")} test="spindle" />
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
