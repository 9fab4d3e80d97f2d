/** Settings on their way to the controller: what would change is shown first, then every refusal. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { controller, fail, noHoming } from "../app";
import { RefusedError } from "../link/controller";
import { same, sendingOrder } from "../link/settingsfile";
import { errorWords, findSetting, settingProblem } from "../tables";
import { Button, Dialog, Notice } from "./parts";
import { t } from "../words";

type Values = ReadonlyMap<number, string>;

/** Numbers of these that the controller has and that would change. */
export function changesOf(values: Values): number[] {
  const current = controller.settings.value;
  return [...values.keys()].filter((number) => {
    const [before, after, setting] = [current.get(number), values.get(number)!, findSetting(number)];
    return before !== undefined && (setting ? after.trim() === "" || !same(setting.row, before, after) : before !== after);
  });
}

export function settingTitle(number: number): string {
  const setting = findSetting(number);
  return setting ? `$${number} ${setting.row.name} ${setting.axis}`.trim() : `$${number}`;
}

/** Of settings in a file that this controller lacks; "": it has all. */
export function missingText(values: Values): string {
  const missing = [...values.keys()].filter((number) => !controller.settings.value.has(number));
  return missing.length > 0 ? t`This controller does not have ${missing.map(settingTitle).join(", ")}: left out.` : "";
}

interface Refusal {
  number: number;
  why: string;
}

/** One after the other; the others continue after a refused one. Rejects when no one will answer any more. */
async function send(numbers: readonly number[], values: Values, onWritten: (number: number, before: string) => void): Promise<Refusal[]> {
  const refused: Refusal[] = [];
  const order = sendingOrder(numbers, controller.settings.value, values);
  const before = new Map(controller.settings.value);
  for (const number of order) {
    try {
      await controller.send(`$${number}=${values.get(number)}`);
      onWritten(number, before.get(number) ?? "");
    } catch (error) {
      if (!(error instanceof RefusedError) || error.code === null) throw error;
      refused.push({ number, why: t`error ${error.code}, ${errorWords(error.code)}` });
    }
  }
  await controller.send("$$");
  const answered = new Set(refused.map(({ number }) => number));
  for (const number of changesOf(values)) {
    if (order.includes(number) && !answered.has(number)) refused.push({ number, why: t`it is still ${controller.settings.value.get(number)}` });
  }
  return refused;
}

export interface ApplyProps {
  title: string;
  values: Values;
  /** Each one that the controller has taken, and what it was before. */
  onWritten: (number: number, before: string) => void;
  /** All were sent, and those in the list were refused. */
  onSent?: (refused: readonly number[]) => void;
  onClose: () => void;
}

export function ApplyDialog({ title, values, onWritten, onSent, onClose }: ApplyProps): JSX.Element {
  const rows = useSignal<readonly number[]>([]);
  const refused = useSignal<readonly Refusal[] | null>(null);
  const sending = useSignal(false);
  useEffect(() => void (rows.value = sendingOrder(changesOf(values), controller.settings.value, values)), []);
  const go = async (): Promise<void> => {
    sending.value = true;
    try {
      const bad = await send(rows.value, values, onWritten);
      onSent?.(bad.map(({ number }) => number));
      refused.value = bad;
      if (bad.length === 0) onClose();
    } catch (error) {
      fail(error);
      onClose();
    }
  };
  return (
    <Dialog title={title} onClose={onClose}>
      {refused.value ? <Refused refused={refused.value} total={rows.value.length} onClose={onClose} /> : (
        <>
          <Review rows={rows.value} values={values} />
          <div class="row">
            {rows.value.length > 0 && (
              <Button kind="primary" why={noHoming.value} disabled={sending.value || problems(rows.value, values).length > 0} onClick={() => void go()} testId="settings-send">
                {sending.value ? t`Writing` : t`Write`}
              </Button>
            )}
            <Button onClick={onClose}>{rows.value.length > 0 ? t`Cancel` : t`Close`}</Button>
          </div>
        </>
      )}
    </Dialog>
  );
}

function problems(rows: readonly number[], values: Values): string[] {
  return rows.flatMap((number) => {
    const setting = findSetting(number);
    const why = setting ? settingProblem(setting.row, values.get(number)!) : "";
    return why ? [`${settingTitle(number)}: ${why}`] : [];
  });
}

function Review({ rows, values }: { rows: readonly number[]; values: Values }): JSX.Element {
  const missing = missingText(values);
  const later = rows.filter((number) => findSetting(number)?.row.reboot);
  const wrong = problems(rows, values);
  return (
    <>
      {rows.length === 0 ? (
        <p data-test="settings-none">{t`The controller has all of these values already.`}</p>
      ) : (
        <div class="scroll">
          <table data-test="settings-review">
            <thead>
              <tr>
                <th>{t`Setting`}</th>
                <th class="number">{t`now`}</th>
                <th class="number">{t`then`}</th>
              </tr>
            </thead>
            <tbody>
              {rows.map((number) => (
                <tr key={number}>
                  <td>{settingTitle(number)}</td>
                  <td class="number mono">{controller.settings.value.get(number)}</td>
                  <td class="number mono">{values.get(number)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      {wrong.length > 0 && <Notice kind="bad" title={wrong.join("; ")} />}
      {missing && <Notice kind="warn" title={missing} />}
      {later.length > 0 && <p class="small soft">{t`Restart the controller afterwards: ${later.map((n) => `$${n}`).join(", ")} take effect at the next start.`}</p>}
    </>
  );
}

function Refused({ refused, total, onClose }: { refused: readonly Refusal[]; total: number; onClose: () => void }): JSX.Element {
  const written = total - refused.length;
  return (
    <>
      <Notice kind="bad" title={t`${refused.length} of ${total} settings were refused`} text={written === 1 ? t`One was written.` : t`${written} were written.`} />
      <ul class="small" data-test="settings-refused">
        {refused.map(({ number, why }) => (
          <li key={number}>
            {settingTitle(number)}: {why}
          </li>
        ))}
      </ul>
      <div class="row">
        <Button kind="primary" onClick={onClose} testId="settings-close">
          {t`Close`}
        </Button>
      </div>
    </>
  );
}

type Machines = (typeof import("../link/profile"))["MACHINES"];

/** A profile that comes with WiFiCNC: they are loaded when someone looks for them. */
export function MachineChoice({ onChoose }: { onChoose: (values: Values, name: string) => void }): JSX.Element {
  const machines = useSignal<Machines>([]);
  const load = (): void => {
    if (machines.value.length === 0) void import("../link/profile").then(({ MACHINES }) => (machines.value = MACHINES), fail);
  };
  return (
    <select
      class="input system"
      aria-label={t`Machine profile`}
      onPointerDown={load}
      onFocus={load}
      value=""
      onChange={(event) => {
        const found = machines.value.find(({ id }) => id === event.currentTarget.value);
        event.currentTarget.value = "";
        if (found) onChoose(found.values, found.name);
      }}
      data-test="machine-profile"
    >
      <option value="">{t`Machine profile`}</option>
      {machines.value.map(({ id, name }) => (
        <option key={id} value={id}>
          {name}
        </option>
      ))}
    </select>
  );
}
