/** Manual outputs, inputs as they are, and what the board's spare inputs and its mode are for. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, controller, noLines } from "../app";
import { board } from "../chosen";
import { setValue, valueOf } from "../storage/board";
import { isModule, moduleFaults, storedNumber } from "../storage/module";
import type { StoredNumber } from "../tables";
import { ModuleCard } from "./module";
import { Button, Card, Check, Field, Notice } from "./parts";
import { BoardChoice } from "./pins";
import { StorageBar } from "./storage";
import { msg, t, tr } from "../words";

const rpm = signal(1000);
/** Of M62 to M65. */
const OUTPUTS = 5;

export function InOutTab(): JSX.Element {
  return (
    <div class="columns">
      <div class="w6 stack">
        <OutputCard />
      </div>
      <div class="w6 stack">
        <RoleCard />
        <ModuleCard />
      </div>
    </div>
  );
}

function say(line: string): void {
  void attempt(() => controller.send(line));
}

function OutputCard(): JSX.Element {
  const why = noLines.value;
  const lamps = controller.accessories.value;
  return (
    <Card title={t`Manual outputs`}>
      <h3>{t`Spindle`}</h3>
      <div class="row">
        <input
          class="input short mono"
          type="number"
          min={0}
          step={100}
          aria-label={t`Spindle speed, rpm`}
          value={rpm.value}
          onChange={(event) => (rpm.value = Math.max(0, Number(event.currentTarget.value)))}
        />
        <span class="small soft">{t`rpm`}</span>
        <Button why={why} pressed={lamps.includes("S")} machine="starts" onClick={() => say(`M3S${rpm.value}`)}>
          {t`Clockwise`}
        </Button>
        <Button why={why} pressed={lamps.includes("C")} machine="starts" onClick={() => say(`M4S${rpm.value}`)}>
          {t`Counter-clockwise`}
        </Button>
        <Button why={why} kind="warn" machine="stops" onClick={() => say("M5")}>
          {t`Off`}
        </Button>
      </div>
      <h3>{t`Coolant`}</h3>
      <div class="row">
        <Button why={why} pressed={lamps.includes("F")} machine="starts" onClick={() => say("M8")}>
          {t`Flood`}
        </Button>
        <Button why={why} pressed={lamps.includes("M")} machine="starts" onClick={() => say("M7")}>
          {t`Mist`}
        </Button>
        <Button why={why} kind="warn" machine="stops" onClick={() => say("M9")}>
          {t`Off`}
        </Button>
      </div>
      <h3>{t`Outputs of M62 to M65`}</h3>
      <div class="row">
        {Array.from({ length: OUTPUTS }, (_, i) => (
          <span key={i} class="pair" role="group" aria-label={t`Output ${i}`}>
            <Button why={why} machine="starts" label={t`Output ${i} on`} onClick={() => say(`M64P${i}`)} testId={`output-on-${i}`}>
              {t`Output ${i}`}
            </Button>
            <Button why={why} kind="warn" machine="stops" label={t`Output ${i}: off`} onClick={() => say(`M65P${i}`)} testId={`output-off-${i}`}>
              {t`Off`}
            </Button>
          </span>
        ))}
      </div>
      <p class="small soft">{t`An output that the board does not have is refused.`}</p>
    </Card>
  );
}

const ROLES = [
  ["in_door", msg`Safety door`],
  ["in_hold", msg`Hold button`],
  ["in_start", msg`Start button`],
] as const;

function RoleCard(): JSX.Element {
  if (board.value.target !== "esp32")
    return (
      <Card title={t`Inputs and mode`} tools={<BoardChoice />}>
        <p class="soft">{t`The inputs of ${tr(board.value.name)} are those of its board file.`}</p>
      </Card>
    );
  const inputs = board.value.uses.filter((use) => use.signal.startsWith("misc_in_"));
  return (
    <Card title={t`Inputs and mode`} tools={<BoardChoice />}>
      <StorageBar problem={moduleFaults(board.value).join("; ")} />
      {ROLES.map(([key, name]) => (
        <InputRole key={key} name={tr(name)} row={storedNumber(key)} inputs={inputs.length} />
      ))}
      <ModuleMode row={storedNumber("dev_mode")} />
    </Card>
  );
}

function InputRole({ name, row, inputs }: { name: string; row: StoredNumber; inputs: number }): JSX.Element {
  return (
    <Field label={name} hint={tr(row.help)}>
      <select class="input" value={Number(valueOf(row.key) ?? row.default)} onChange={(event) => setValue(row.key, Number(event.currentTarget.value))}>
        <option value={row.default}>{t`none`}</option>
        {Array.from({ length: inputs }, (_, i) => (
          <option key={i} value={i}>
            {t`input ${i}`}
          </option>
        ))}
      </select>
    </Field>
  );
}

function ModuleMode({ row }: { row: StoredNumber }): JSX.Element {
  return (
    <>
      <Check label={t`This board is an I/O expansion module`} checked={isModule()} onChange={(on) => setValue(row.key, on ? 1 : 0)} />
      {isModule() && <Notice kind="warn" title={t`A module has no motion`} text={t`It has no G-code and no web page: WMC3 hosts control it.`} />}
    </>
  );
}
