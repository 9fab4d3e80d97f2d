/** All settings by name, unit and range: changed here, compared, and only then sent. */
import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, controller, noHoming, unknownYet } from "../app";
import { defaultsText, exportText, same } from "../link/settingsfile";
import { findSetting, settingName, settingProblem, settingsOf, type Setting } from "../tables";
import { ApplyDialog, changesOf, MachineChoice, missingText } from "./apply";
import { later } from "./later";
import { Button, Card, Check, Dialog, FileButton, Notice, saveFile } from "./parts";
import { TrustCard } from "./trust";
import { VibrationCard } from "./vibration";
import { t, tr } from "../words";

/** $N -> what was typed and is not sent yet. */
const edits = signal<ReadonlyMap<number, string>>(new Map());
const search = signal("");
const onlyChanged = signal(false);
const asks = signal<"apply" | "restore" | null>(null);

/** What was imported last, for the notice above the table. */
const brought = signal<{ title: string; text: string } | null>(null);

const current = controller.settings;

/** What would change on the controller. */
const changes = computed(() => changesOf(edits.value).map((number) => [number, edits.value.get(number)!] as const));

const problems = computed(() =>
  changes.value.filter(([number, text]) => {
    const setting = findSetting(number);
    return setting !== undefined && settingProblem(setting.row, text) !== "";
  }),
);

/** Only boards with such drives show them. */
const Drives = later(async () => (await import("./drives")).Drives);

export function SettingsTab(): JSX.Element {
  return (
    <div class="stack">
      {current.value.size > 0 && <Drives />}
      <VibrationCard onUse={edit} />
      <SettingsCard />
      <TrustCard />
    </div>
  );
}

/** Values that another card has found: they become edits, too. */
function edit(values: ReadonlyMap<number, string>): void {
  edits.value = new Map([...edits.value, ...values]);
}

function SettingsCard(): JSX.Element {
  if (current.value.size === 0)
    return (
      <Card title={t`Settings`}>
        <p class="soft">{unknownYet.value || t`Connect to a controller to see its settings.`}</p>
      </Card>
    );
  return (
    <Card title={t`Settings`} tools={<Tools />}>
      {brought.value && (
        <Notice kind={brought.value.text ? "warn" : "info"} {...brought.value}>
          <Button size="small" onClick={() => (brought.value = null)}>
            {t`Close`}
          </Button>
        </Notice>
      )}
      <ChangeBar />
      <div class="row">
        <input
          class="input grow"
          type="search"
          placeholder={t`Find by number, name or word`}
          aria-label={t`Find a setting`}
          value={search.value}
          onInput={(event) => (search.value = event.currentTarget.value)}
        />
        <Check label={t`Only settings that differ from the default`} checked={onlyChanged.value} onChange={(on) => (onlyChanged.value = on)} />
      </div>
      <SettingTable />
      {asks.value === "apply" && <ApplyEdits />}
      {asks.value === "restore" && <RestoreDialog />}
    </Card>
  );
}

function Tools(): JSX.Element {
  return (
    <>
      <Button size="small" onClick={() => saveFile("settings.toml", exportText(current.value, controller.linkName.value))} testId="settings-export">
        {t`Export`}
      </Button>
      <FileButton size="small" accept=".toml,.txt,.nc,.gcode,.settings" onFile={(file) => void attempt(() => importFile(file))} testId="settings-file">
        {t`Import`}
      </FileButton>
      <MachineChoice onChoose={bring} />
      <Button size="small" why={noHoming.value} onClick={() => (asks.value = "restore")}>
        {t`Restore defaults`}
      </Button>
    </>
  );
}

/** The values of a file or a profile become edits; nothing is sent yet. */
function bring(values: ReadonlyMap<number, string>, name: string): void {
  edit(new Map([...values].filter(([number]) => current.value.has(number))));
  const count = changesOf(values).length;
  const changed = count === 0 ? t`nothing to change` : count === 1 ? t`one setting differs` : t`${count} settings differ`;
  brought.value = { title: `${name}: ${changed}`, text: missingText(values) };
}

async function importFile(file: File): Promise<void> {
  const { readSettings } = await import("../link/settingsimport");
  bring(await readSettings(await file.text()), file.name);
}

function ChangeBar(): JSX.Element | null {
  const count = changes.value.length;
  if (count === 0) return null;
  const wrong = problems.value.length;
  return (
    <Notice
      kind={wrong ? "bad" : "warn"}
      title={count === 1 ? t`One setting is changed and not applied yet` : t`${count} settings are changed and not applied yet`}
      text={wrong ? t`${wrong} out of range` : ""}
    >
      <Button size="small" kind="primary" disabled={wrong > 0} why={noHoming.value} onClick={() => (asks.value = "apply")} testId="settings-apply">
        {t`Review and apply`}
      </Button>
      <Button size="small" onClick={() => ((edits.value = new Map()), (brought.value = null))}>
        {t`Discard`}
      </Button>
    </Notice>
  );
}

function matches(setting: Setting): boolean {
  const words = `$${setting.number} ${setting.row.name} ${settingName(setting.row)} ${setting.axis} ${tr(setting.row.help)}`.toLowerCase();
  if (!search.value.toLowerCase().split(/\s+/).every((word) => words.includes(word))) return false;
  const now = current.value.get(setting.number);
  return !onlyChanged.value || now === undefined || !same(setting.row, now, defaultsText(setting.row)) || edits.value.has(setting.number);
}

function SettingTable(): JSX.Element {
  const axes = controller.axisCount.value || 3;
  const shown = settingsOf(axes).filter((setting) => current.value.has(setting.number) && matches(setting));
  return (
    <div class="scroll">
      <table>
        <thead>
          <tr>
            <th class="number">$</th>
            <th>{t`Setting`}</th>
            <th>{t`Value`}</th>
            <th class="hide-narrow">{t`Unit`}</th>
            <th class="hide-narrow">{t`Range`}</th>
            <th class="number hide-narrow">{t`Default`}</th>
          </tr>
        </thead>
        <tbody>
          {shown.map((setting) => (
            <SettingLine key={setting.number} setting={setting} />
          ))}
        </tbody>
      </table>
      {shown.length === 0 && <p class="soft">{t`No setting matches.`}</p>}
    </div>
  );
}

function SettingLine({ setting }: { setting: Setting }): JSX.Element {
  const { number, row, axis } = setting;
  const changed = changes.value.some(([other]) => other === number);
  return (
    <tr class={changed ? "changed" : ""} data-test={`setting-${number}`}>
      <td class="number mono faint">{number}</td>
      <td>
        <div>
          {settingName(row)} {axis && <strong>{axis}</strong>}
        </div>
        <div class="small soft">{tr(row.help)}</div>
      </td>
      <td>
        <Value setting={setting} />
      </td>
      <td class="soft hide-narrow">{tr(row.unit)}</td>
      <td class="soft small mono hide-narrow">{row.type === "bool" ? "" : `${row.min} … ${row.max}`}</td>
      <td class="number soft small mono hide-narrow">{defaultsText(row)}</td>
    </tr>
  );
}

function Value({ setting }: { setting: Setting }): JSX.Element {
  const { number, row, axis } = setting;
  const text = edits.value.get(number) ?? current.value.get(number) ?? "";
  const onEdit = (value: string): void => edit(new Map([[number, value]]));
  if (row.type === "bool")
    return (
      <Check
        label={Number(text) ? t`on` : t`off`}
        checked={Number(text) !== 0}
        disabled={!controller.commands.value}
        onChange={(on) => onEdit(on ? "1" : "0")}
      />
    );
  const problem = settingProblem(row, text);
  return (
    <>
      <input
        class="input short mono"
        inputMode="decimal"
        aria-label={`$${number} ${row.name} ${axis}`}
        aria-invalid={problem !== ""}
        title={problem}
        value={text}
        disabled={!controller.commands.value}
        onInput={(event) => onEdit(event.currentTarget.value)}
      />
      {problem && <div class="small">{problem}</div>}
    </>
  );
}

/** A refused one stays an edit. */
function ApplyEdits(): JSX.Element {
  const sent = (refused: readonly number[]): void => void (edits.value = new Map([...edits.value].filter(([number]) => refused.includes(number))));
  return <ApplyDialog title={t`Apply these settings?`} values={edits.value} onWritten={() => {}} onSent={sent} onClose={() => (asks.value = null)} />;
}

function RestoreDialog(): JSX.Element {
  const restore = async (): Promise<void> => {
    asks.value = null;
    edits.value = new Map();
    // The controller starts again behind it, and its settings are read again then.
    await attempt(async () => {
      await controller.post("$RST=$");
      await controller.getToKnow();
    });
  };
  return (
    <Dialog title={t`Restore all defaults?`} onClose={() => (asks.value = null)}>
      <p>{t`Every setting returns to its default. Export them first if you may need them again.`}</p>
      <div class="row">
        <Button kind="danger" why={noHoming.value} onClick={() => void restore()}>
          {t`Restore`}
        </Button>
        <Button onClick={() => (asks.value = null)}>{t`Cancel`}</Button>
      </div>
    </Dialog>
  );
}
