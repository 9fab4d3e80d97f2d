/** Where the machine is, in work coordinates: read from far, typed, zeroed and undone. */
import { signal, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { attempt, axesShown, controller, move, noHoming, noMotion, noPlace, standing } from "../app";
import { typedPosition, WORK_SYSTEMS } from "../link/offsets";
import { modesNow, type Status } from "../link/messages";
import { planZero, type ZeroFacts, type ZeroPlan } from "../link/zero";
import { AXES } from "../tables";
import { isUnitUnknown, lastZero, nameSystem, setPosition, showsInches, systemNames, undoZero, workSystem } from "../zeroing";
import { Button, Card, Dialog, Field } from "./parts";
import { msg, t, tr } from "../words";

/** The positions over the whole width, for a look from across the shop. */
export const isLarge = signal(false);
/** The axis whose position is being typed. */
const typing = signal("");
const MM_PER_INCH = 25.4;

export function PositionCard(): JSX.Element {
  const axes = [...AXES.slice(0, axesShown.value)];
  const asks = useSignal(false);
  const zeroAll = (): Promise<void> => setPosition(Object.fromEntries(axes.map((axis) => [axis, 0])), t`zero of all axes`);
  const last = lastZero.value;
  return (
    <Card title={positionTitle()} tools={<PositionTools />}>
      <div class={`dro ${isLarge.value ? "large" : ""}`}>
        {axes.map((axis, i) => (
          <Axis key={axis} axis={axis} index={i} />
        ))}
      </div>
      <div class="row">
        <Button icon="home" machine="starts" why={noHoming.value} onClick={() => void attempt(() => controller.send("$H"))} testId="home">
          {t`Home`}
        </Button>
        <Button machine="sets" why={noMotion.value} onClick={() => void attempt(zeroAll)} testId="zero-all">
          {t`Zero all`}
        </Button>
        <Button
          machine="starts"
          why={noMotion.value}
          title={t`Raise Z, then move X and Y to work zero`}
          onClick={() => void attempt(async () => (asks.value = await goToZero(null)))}
          testId="go-to-zero"
        >
          {t`Go to zero`}
        </Button>
        <Button machine="sets" why={noMotion.value} disabled={!last} title={last ? t`Undo: ${last.text}` : undefined} onClick={() => void attempt(undoZero)} testId="undo-zero">
          {t`Undo zero`}
        </Button>
      </div>
      <p class="small soft reserved" data-test="why-not">
        {controller.connected.value && noMotion.value}
      </p>
      {asks.value && <LiftDialog onClose={() => (asks.value = false)} />}
      <Lamps />
    </Card>
  );
}

function positionTitle(): string {
  if (isUnitUnknown.value) return t`Position, unit not reported yet`;
  return showsInches.value ? t`Position, inch` : t`Position, mm`;
}

/** With its unit, where that is known. */
function feedWords(feed: number): string {
  if (isUnitUnknown.value) return String(feed);
  return showsInches.value ? t`${feed.toFixed(1)} inch/min` : t`${feed.toFixed(0)} mm/min`;
}

const SAME_HEIGHT_MM = 0.05;

export function zeroFacts(): ZeroFacts {
  const { machine_mm, origin_mm, homed, settings } = standing.value;
  return { axisCount: controller.axisCount.value, homed, machine_mm, offset_mm: origin_mm, settings };
}

/** @returns whether someone has to say first how far Z lifts */
async function goToZero(lift_mm: number | null): Promise<boolean> {
  if (noPlace.value) throw new Error(noPlace.value);
  return goBy(() => planZero(zeroFacts(), lift_mm));
}

/** From where the machine rests: a jog of before may be on its way, and not in the last report. Each line when the one
 * before has been moved completely. @returns whether someone has to say first how far Z lifts */
export async function goBy(planNow: () => ZeroPlan): Promise<boolean> {
  if (planNow().kind === "ask") return true;
  const stops = controller.stops;
  await controller.rest();
  const plan = planNow();
  if (plan.kind === "ask") return true;
  if (plan.kind === "refuse") throw new Error(plan.why);
  for (const [i, line] of plan.lines.entries()) {
    if (i > 0 && plan.z_mm !== null && Math.abs(zeroFacts().machine_mm[2]! - plan.z_mm) > SAME_HEIGHT_MM)
      throw new Error(t`Z did not reach its height, so X and Y do not move.`);
    await move(line, stops);
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
    <Dialog
      title={t`How far can Z lift?`}
      onClose={onClose}
      actions={
        <div class="row">
          <Button kind="primary" machine="starts" why={noMotion.value} disabled={!(lift_mm >= 0)} onClick={go} testId="lift-go">
            {t`Lift and move`}
          </Button>
          <Button onClick={onClose}>{t`Cancel`}</Button>
        </div>
      }
    >
      <p class="soft">
        {t`The machine was not homed while this page was connected, so the free travel above Z is unknown. Z lifts by this distance from where it is now, then X and Y move straight to work zero at that height.`}
      </p>
      <Field label={t`Lift Z by, mm`} hint={t`0: Z does not move.`}>
        <input class="input short mono" type="number" min={0} step={1} value={lift.value} onInput={(event) => (lift.value = event.currentTarget.value)} data-test="lift" />
      </Field>
    </Dialog>
  );
}

function Axis({ axis, index }: { axis: string; index: number }): JSX.Element {
  const work = controller.workPosition.value[index];
  const machine = controller.machinePosition.value[index];
  const halve = async (): Promise<void> => {
    await controller.rest(); // half of where it is, which the last report may not know
    const half = controller.workPosition.peek()[index]! / 2;
    await setPosition({ [axis]: (showsInches.peek() ? MM_PER_INCH : 1) * half }, t`half of ${axis}`);
  };
  return (
    <div class="dro-axis">
      <span class="dro-letter">{axis}</span>
      {typing.value === axis && work !== undefined ? (
        <TypedPosition axis={axis} value={fixed(work)} />
      ) : (
        <button
          type="button"
          class="dro-work mono"
          data-test={`work-${axis}`}
          disabled={noMotion.value !== ""}
          title={noMotion.value || t`Type the work position of ${axis}`}
          onClick={() => (typing.value = axis)}
        >
          {work === undefined ? "–" : fixed(work)}
        </button>
      )}
      <span class="dro-machine mono" title={t`Machine position`}>
        {machine === undefined ? "" : fixed(machine)}
      </span>
      <div class="dro-set">
        <Button size="small" machine="sets" label={t`Halve ${axis}`} title={t`Half of ${axis} is here: zero is in the middle of the way`} why={noMotion.value} onClick={() => void attempt(halve)}>
          ½
        </Button>
        <Button size="small" machine="sets" label={t`Zero ${axis}`} why={noMotion.value} onClick={() => void attempt(() => setPosition({ [axis]: 0 }, t`zero of ${axis}`))}>
          {t`Zero`}
        </Button>
      </div>
    </div>
  );
}

/** Enter sets, Escape and a look elsewhere leave everything as it was. */
function TypedPosition({ axis, value }: { axis: string; value: string }): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  const text = useSignal(value);
  useEffect(() => input.current?.select(), []);
  const mm = typedPosition(text.value, showsInches.value);
  const leave = (): void => void (typing.value = "");
  const onKey = (event: KeyboardEvent): void => {
    if (event.key === "Escape") leave();
    if (event.key !== "Enter" || mm === null) return;
    leave();
    void attempt(() => setPosition({ [axis]: mm }, t`position of ${axis}`));
  };
  return (
    <input
      ref={input}
      class="input dro-work mono"
      aria-label={t`Work position of ${axis}. Enter sets it, Escape leaves it`}
      aria-invalid={mm === null}
      inputmode="decimal"
      autocomplete="off"
      value={text.value}
      onInput={(event) => (text.value = event.currentTarget.value)}
      onKeyDown={onKey}
      onBlur={leave}
      data-test={`typed-${axis}`}
    />
  );
}

function fixed(value: number): string {
  return (Object.is(value, -0) ? 0 : value).toFixed(3);
}

function PositionTools(): JSX.Element {
  const names = useSignal(false);
  const current = workSystem.value;
  return (
    <>
      <label class="row small soft">
        <span class="hide-narrow">{t`Work system`}</span>
        <select
          class="input system"
          aria-label={t`Work system`}
          value={current}
          disabled={noMotion.value !== ""}
          title={noMotion.value || undefined}
          onChange={(event) => {
            const chosen = event.currentTarget.value;
            void attempt(async () => {
              await controller.send(chosen);
              await controller.refresh("$G");
            });
          }}
        >
          {WORK_SYSTEMS.map((name) => (
            <option key={name} value={name}>
              {systemNames.value[name] ? `${name} ${systemNames.value[name]}` : name}
            </option>
          ))}
        </select>
      </label>
      <Button size="small" title={t`Give ${current} a name, for this browser`} onClick={() => (names.value = true)} testId="name-system">
        {t`Name`}
      </Button>
      <span class="hide-narrow">
        <Button size="small" pressed={isLarge.value} title={t`Positions over the whole width`} onClick={() => (isLarge.value = !isLarge.value)} testId="large">
          {t`Large`}
        </Button>
      </span>
      {names.value && <NameDialog system={current} onClose={() => (names.value = false)} />}
    </>
  );
}

const NAME_LENGTH = 24;

function NameDialog({ system, onClose }: { system: string; onClose: () => void }): JSX.Element {
  const name = useSignal(systemNames.value[system] ?? "");
  return (
    <Dialog title={t`Name of ${system}`} onClose={onClose}>
      <form
        class="stack"
        onSubmit={(event) => {
          event.preventDefault();
          nameSystem(system, name.value);
          onClose();
        }}
      >
        <Field label={t`Name`} hint={t`Stored in this browser.`}>
          <input class="input" maxLength={NAME_LENGTH} value={name.value} onInput={(event) => (name.value = event.currentTarget.value)} data-test="system-name" />
        </Field>
        <div class="row">
          <button class="button primary" type="submit">
            {t`Save`}
          </button>
          <Button onClick={onClose}>{t`Cancel`}</Button>
        </div>
      </form>
    </Dialog>
  );
}

const LAMPS: readonly [string, string][] = [
  ["P", msg`Probe`],
  ["D", msg`Door`],
  ["H", msg`Hold input`],
  ["M", msg`Driver fault`],
  ["R", msg`Reset input`],
  ["S", msg`Start input`],
  ["T", msg`M1 stops`],
];

/** "12000 rpm", "12000 rpm, measured 11950, 3.1 A". */
export function spindleWords(status: Status | null): string {
  const words = [t`${(status?.speed ?? 0).toFixed(0)} rpm`];
  if (status && status.measured !== null) words.push(t`measured ${status.measured.toFixed(0)}`);
  if (status && status.ampere !== null) words.push(`${status.ampere.toFixed(1)} A`);
  return words.join(", ");
}

function Lamps(): JSX.Element {
  const pins = controller.status.value?.pins ?? "";
  const axes = [...AXES.slice(0, axesShown.value)];
  const spindle = spindleWords(controller.status.value);
  return (
    <div class="stack">
      <div class="lamps" aria-label={t`Inputs`}>
        {axes.map((axis) => (
          <span key={axis} class={`lamp ${pins.includes(axis) ? "on" : ""}`}>
            {t`${axis} limit`}
          </span>
        ))}
        {LAMPS.map(([letter, name]) => (
          <span key={letter} class={`lamp ${pins.includes(letter) ? "on" : ""}`}>
            {tr(name)}
          </span>
        ))}
      </div>
      <dl class="facts">
        <dt>{t`Feed`}</dt>
        <dd class="mono" data-test="feed-now">{feedWords(controller.status.value?.feed ?? 0)}</dd>
        <dt>{t`Spindle`}</dt>
        <dd class="mono">{spindle}</dd>
        <dt>{t`Modes`}</dt>
        <dd class="mono small modes">{modesNow(controller.modes.value, controller.accessories.value, controller.status.value?.speed ?? 0) || "–"}</dd>
      </dl>
    </div>
  );
}
