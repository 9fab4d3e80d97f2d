/** Motor drivers with registers: how each is, and its settings. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { controller, noHoming } from "../app";
import { currentProblem, scaledSteps, settingsAxis, type Driver } from "../link/drives";
import { AXES, settingNumber } from "../tables";
import { ApplyDialog } from "./apply";
import { anyProblem, SettingField, textOf, type Edits } from "./fields";
import { Button, Card, Check, Dialog, Field, Notice } from "./parts";
import { msg, t, tr } from "../words";

const CURRENT = settingNumber("driver_current_ma");
const MICROSTEPS = settingNumber("driver_microsteps");
const STEPS = settingNumber("steps_per_mm");
const FAULT = settingNumber("driver_fault");
const FIELDS = [
  ["driver_current_ma", msg`Motor current, mA`],
  ["driver_hold_pct", msg`Current at rest, %`],
  ["driver_microsteps", msg`Microsteps`],
  ["driver_stealth_mm_min", msg`stealthChop below, mm/min`],
  ["driver_coolstep", msg`coolStep`],
  ["driver_stall", msg`StallGuard: sensitivity`],
  ["driver_stall_mm_min", msg`StallGuard: slowest speed, mm/min`],
].map(([name, label]) => [settingNumber(name!), label!] as const);
const MICROSTEP_CHOICES = Array.from({ length: 9 }, (_, power) => [String(2 ** power), String(2 ** power)] as const);
const SCALES = 32;

const STATES = {
  verified: ["good", msg`verified`],
  unwritten: ["", msg`not written`],
  written: ["busy", msg`being written`],
} as const;

/** The controller's words for what is wrong, and what to do. */
const PROBLEMS: Readonly<Record<string, readonly [name: string, what: string]>> = {
  mute: [msg`receives nothing`, msg`Not even what is sent comes back: check the UART's wires, RX and TX.`],
  silent: [msg`no answer`, msg`Check the motor supply, the wires of its bus and its address.`],
  garbled: [msg`garbled answers`, msg`Check its wires, and for two drivers with one address.`],
  "other chip": [msg`another chip`, msg`The board file has another driver.kind.`],
  "write lost": [msg`does not take writes`, msg`It answers and does not take what is written: check the wire from the board to it.`],
  reset: [msg`was reset`, msg`Its supply failed for a moment: check the motor supply.`],
  undervoltage: [msg`undervoltage`, msg`Check the motor supply.`],
  short: [msg`short circuit`, msg`Its outputs are off. Switch off, check motor and cable.`],
  "shut down": [msg`too hot, shut down`, msg`Its outputs are off. Cool it, or lower its current.`],
  hot: [msg`hot`, msg`It will shut down soon. Cool it, or lower its current.`],
  open: [msg`coil without current`, msg`Switch off, and check the cable of the motor.`],
  "other steps": [msg`does not see its steps`, msg`Check its address and its step wire.`],
};
const HELD = new Set(["Hold", "Tool", "Door"]);
const WARNINGS = new Set(["hot", "open"]);

export function DriversCard({ drivers }: { drivers: readonly Driver[] }): JSX.Element {
  const changed = useSignal<string | null>(null);
  const values = useSignal<Edits | null>(null);
  const driver = drivers.find(({ name }) => name === changed.value);
  const review = (edits: Edits): void => {
    changed.value = null;
    values.value = edits;
  };
  return (
    <Card title={t`Motor drivers`}>
      {drivers.flatMap((each) => each.problems.map((problem) => <Problem key={each.name + problem} driver={each} problem={problem} />))}
      {controller.driverSays.value && HELD.has(controller.state.value) && (
        <Notice kind="warn" title={t`In a hold the drivers cannot be asked. The controller has reported:`} text={controller.driverSays.value} />
      )}
      <DriverTable drivers={drivers} onChange={(name) => (changed.value = name)} />
      <p class="small soft">
        {t`Verified: the driver has answered with what was written. Load is StallGuard's result while the motor turns: the less, the heavier.`}
      </p>
      <FaultChoice onChoose={(text) => review(new Map([[FAULT, text]]))} />
      {driver && <DriverDialog driver={driver} drivers={drivers} onReview={review} onClose={() => (changed.value = null)} />}
      {values.value && <ApplyDialog title={t`Apply these settings?`} values={values.value} onWritten={() => {}} onClose={() => (values.value = null)} />}
    </Card>
  );
}

function Problem({ driver, problem }: { driver: Driver; problem: string }): JSX.Element {
  const [name, what] = PROBLEMS[problem] ?? [problem, ""];
  return <Notice kind={WARNINGS.has(problem) ? "warn" : "bad"} title={t`Driver ${driver.name}: ${tr(name)}`} text={tr(what)} />;
}

function DriverTable({ drivers, onChange }: { drivers: readonly Driver[]; onChange: (name: string) => void }): JSX.Element {
  return (
    <div class="scroll">
      <table data-test="drivers">
        <thead>
          <tr>
            <th>{t`Motor`}</th>
            <th>{t`State`}</th>
            <th class="number hide-narrow">{t`in use`}</th>
            <th class="number hide-narrow">{t`Microsteps`}</th>
            <th class="number hide-narrow">{t`Load`}</th>
            <th class="number hide-narrow">{t`Resets`}</th>
            <th>
              <span class="hidden-text">{t`Change`}</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {drivers.map((driver) => (
            <DriverRow key={driver.name} driver={driver} onChange={() => onChange(driver.name)} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function DriverRow({ driver, onChange }: { driver: Driver; onChange: () => void }): JSX.Element {
  const { name, chip, place, state, problems } = driver;
  const isWarned = state === "fault" && problems.every((problem) => WARNINGS.has(problem));
  const [kind, text] = state === "fault" ? [isWarned ? "warn" : "bad", ""] : STATES[state];
  const words = text ? tr(text) : problems.map((problem) => tr(PROBLEMS[problem]?.[0] ?? problem)).join(", ");
  return (
    <tr data-test={`driver-${name}`}>
      <td>
        <strong>{name}</strong> <span class="small soft hide-narrow">{t`${chip}, place ${place}`}</span>
      </td>
      <td>
        <span class={`chip ${kind}`}>{words}</span> <span class="mono">{t`${driver.current_ma} mA`.replace(" ", "\u00a0")}</span>
      </td>
      <td class="number mono hide-narrow">
        {driver.scale + 1}/{SCALES}
      </td>
      <td class="number mono hide-narrow">{driver.microsteps}</td>
      <td class="number mono hide-narrow">{driver.load}</td>
      <td class="number mono hide-narrow">{driver.resets}</td>
      <td class="number">
        <Button size="small" label={t`Change driver ${name}`} onClick={onChange} testId={`driver-change-${name}`}>
          {t`Change`}
        </Button>
      </td>
    </tr>
  );
}

function FaultChoice({ onChoose }: { onChoose: (text: string) => void }): JSX.Element {
  const now = controller.settings.value.get(FAULT) ?? "";
  return (
    <Field label={t`A fault of a driver`}>
      <select
        class="input"
        value={now}
        disabled={noHoming.value !== ""}
        title={noHoming.value}
        onChange={(event) => {
          const text = event.currentTarget.value;
          event.currentTarget.value = now;
          onChoose(text);
        }}
        data-test="driver-fault"
      >
        <option value="0">{t`is a message only`}</option>
        <option value="1">{t`is a feed hold`}</option>
        <option value="2">{t`stops the axes, then alarm 54: home again`}</option>
      </select>
    </Field>
  );
}

interface DialogProps {
  driver: Driver;
  drivers: readonly Driver[];
  onReview: (edits: Edits) => void;
  onClose: () => void;
}

function DriverDialog({ driver, drivers, onReview, onClose }: DialogProps): JSX.Element {
  const typed = useSignal<Edits>(new Map());
  const keeps = useSignal(true);
  const axis = settingsAxis(driver.name, controller.settings.value);
  const same = drivers.filter(({ name }) => settingsAxis(name, controller.settings.value) === axis);
  const most_ma = Math.min(...same.map((each) => each.most_ma));
  const current = textOf(CURRENT + axis, typed.value);
  const problem = currentProblem(current, most_ma);
  // Of the setting: right after a start $DRIVERS has 0.
  const [before, after] = [Number(controller.settings.value.get(MICROSTEPS + axis)), Number(textOf(MICROSTEPS + axis, typed.value))];
  const steps = scaledSteps(controller.settings.value.get(STEPS + axis) ?? "0", before, after);
  const isScaled = keeps.value && after !== before;
  const edits = new Map([...typed.value, ...(isScaled ? [[STEPS + axis, steps] as const] : [])]);
  const onEdit = (number: number, text: string): void => void (typed.value = new Map(typed.value).set(number, text));
  return (
    <Dialog title={t`Driver ${driver.name}, ${driver.chip}`} onClose={onClose}>
      <div class="stack">
        {noHoming.value && <Notice kind="info" title={t`Settings cannot be changed now`} text={noHoming.value} />}
        {same.length > 1 && <Notice kind="info" title={t`The drivers ${same.map(({ name }) => name).join(", ")} have the same settings, those of axis ${AXES[axis]}.`} />}
        {FIELDS.map(([number, label]) => (
          <SettingField
            key={number}
            number={number + axis}
            label={tr(label)}
            edits={typed.value}
            onEdit={onEdit}
            choices={number === MICROSTEPS ? MICROSTEP_CHOICES : undefined}
            hint={number === CURRENT ? t`The motor's data sheet has it, rms; at most ${most_ma} mA here. Begin with half of it.` : undefined}
          />
        ))}
        {problem && <Notice kind="bad" title={problem} />}
        {typed.value.has(CURRENT + axis) && Number(current) === 0 && <ZeroCurrent chip={driver.chip} />}
        {after !== before && (
          <Notice kind="warn" title={t`Other microsteps: the position is lost, home again`}>
            <Check label={t`Steps/mm in proportion: $${STEPS + axis} = ${steps}`} checked={keeps.value} onChange={(on) => (keeps.value = on)} />
          </Notice>
        )}
        <div class="row">
          <Button
            kind="primary"
            why={noHoming.value || problem}
            disabled={edits.size === 0 || anyProblem(edits)}
            onClick={() => onReview(edits)}
            testId="driver-review"
          >
            {t`Review and apply`}
          </Button>
          <Button onClick={onClose}>{t`Cancel`}</Button>
        </div>
      </div>
    </Dialog>
  );
}

function ZeroCurrent({ chip }: { chip: string }): JSX.Element {
  const title = t`Current 0: the registers are not written`;
  const text = chip === "TMC2209" ? t`The driver keeps what it has, until its motor supply is switched off and on; then it runs by its pins.` : t`Without registers this driver is off, and its motor has no force.`;
  return <Notice kind="warn" title={title} text={text} />;
}
