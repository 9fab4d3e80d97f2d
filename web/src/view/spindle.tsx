/** The spindle: the board's own outputs, or a drive (VFD) on RS-485, with its settings. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { controller, noHoming } from "../app";
import type { Spindle } from "../link/drives";
import { settingNumber } from "../tables";
import { ApplyDialog } from "./apply";
import { anyProblem, SettingField, textOf, type Edits } from "./fields";
import { Button, Card, Notice } from "./parts";
import { spindleWords } from "./position";
import { msg, t, tr } from "../words";

const SPINDLE_TYPE = settingNumber("spindle_type");
const LASER = settingNumber("laser_mode");
const BAUD = settingNumber("vfd_baud");
const PARITY = settingNumber("vfd_parity");
type Row = readonly [number: number, label?: string, hint?: string];
const USUAL: readonly Row[] = [
  [settingNumber("spindle_max_rpm"), msg`Highest speed, rpm`, msg`The speed at the drive's maximum frequency.`],
  [settingNumber("spindle_min_rpm"), msg`Slowest speed, rpm`, msg`A smaller S turns it at this speed.`],
  [settingNumber("vfd_rpm_per_hz"), msg`Speed at 1 Hz, rpm`, msg`60 for a motor of 2 poles, 30 for 4 poles.`],
  [settingNumber("at_speed_pct"), msg`At speed within, %`],
  [settingNumber("spindle_on_delay_s"), msg`Wait after a start, s`],
  [settingNumber("vfd_address"), msg`Modbus address`],
  [BAUD, msg`Baud rate`],
  [PARITY, msg`Parity`],
  [settingNumber("vfd_timeout_ms"), msg`Longest wait for an answer, ms`],
];
const OWN_REGISTERS: readonly Row[] = [
  ...["vfd_run_register", "vfd_set_register", "vfd_read_register", "vfd_clockwise", "vfd_counter_clockwise", "vfd_stop"],
  ...["vfd_set_multiplier", "vfd_set_divider", "vfd_read_multiplier", "vfd_read_divider"],
].map((name) => [settingNumber(name)] as const);
/** $395 of the drive whose registers are settings. */
const OWN = 1;
/** Of $374. */
const BAUDS = [2400, 4800, 9600, 19200, 38400, 115200];

function choicesOf(number: number): (readonly [string, string])[] | undefined {
  if (number === BAUD) return [...BAUDS.map((baud, i) => [String(i), String(baud)] as const), [String(BAUDS.length), t`as the model has it`]];
  if (number === PARITY) return [["0", t`no parity`], ["1", t`even parity`], ["2", t`odd parity`], ["3", t`as the model has it`]];
  return undefined;
}

/** Why the spindle's settings cannot be changed now; "": they can. */
function whyNot(): string {
  if (noHoming.value) return noHoming.value;
  return /[SC]/.test(controller.accessories.value) ? t`The spindle is on: switch it off first (M5).` : "";
}

export function SpindleCard({ spindles }: { spindles: readonly Spindle[] }): JSX.Element {
  const typed = useSignal<Edits>(new Map());
  const asks = useSignal(false);
  const chosen = Number(textOf(SPINDLE_TYPE, typed.value));
  const why = whyNot();
  const laser = chosen !== 0 && Number(controller.settings.value.get(LASER) ?? 0) !== 0;
  const rows = chosen === 0 ? [] : [...USUAL, ...(chosen === OWN ? OWN_REGISTERS : [])];
  const onEdit = (number: number, text: string): void => void (typed.value = new Map(typed.value).set(number, text));
  const sent = (refused: readonly number[]): void => void (typed.value = new Map([...typed.value].filter(([number]) => refused.includes(number))));
  return (
    <Card title={t`Spindle`}>
      <p role="status" data-test="spindle-now">
        <strong>{spindleWords(controller.status.value)}</strong>
      </p>
      <SettingField
        number={SPINDLE_TYPE}
        label={t`Driven by`}
        edits={typed.value}
        onEdit={onEdit}
        choices={spindles.map(({ number, name, drive }) => [String(number), drive ? name : t`${name}, an output of the board`] as const)}
        hint={t`A drive (VFD) is commanded by RS-485, confirms each command, and reports its speed.`}
      />
      {laser && <Notice kind="warn" title={t`A laser ($32=1) and a drive exclude each other: set $32=0 first.`} />}
      <div class="fields">
        {rows.map(([number, label, hint]) => (
          <SettingField
            key={number}
            number={number}
            label={label && tr(label)}
            edits={typed.value}
            onEdit={onEdit}
            choices={choicesOf(number)}
            hint={hint && tr(hint)}
          />
        ))}
      </div>
      {why && <p class="small soft">{why}</p>}
      <div class="row">
        <Button kind="primary" why={why} disabled={typed.value.size === 0 || anyProblem(typed.value)} onClick={() => (asks.value = true)} testId="spindle-review">
          {t`Review and apply`}
        </Button>
        <Button disabled={typed.value.size === 0} onClick={() => (typed.value = new Map())}>
          {t`Discard`}
        </Button>
      </div>
      {asks.value && <ApplyDialog title={t`Apply these settings?`} values={typed.value} onWritten={() => {}} onSent={sent} onClose={() => (asks.value = false)} />}
    </Card>
  );
}
