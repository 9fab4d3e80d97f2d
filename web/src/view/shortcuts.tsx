/** Stored positions, the laser's test, the spindle's warm-up, and the user's macros: one press each. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, controller, doing, noHoming, noMotion, standing } from "../app";
import { isLaser } from "../link/fire";
import { macroLines, macroMoves, MOST_MACROS, type Macro } from "../link/macros";
import { planStored, unknownPlace, type StoredName } from "../link/stored";
import { keepMacros, macros, runMacro, stopMacro } from "../macros";
import { FireDialog, WarmDialog } from "./fire";
import { Button, Card, Dialog, Field } from "./parts";
import { later } from "./later";
import { goBy, zeroFacts } from "./position";
import { t } from "../words";

const ToolsDialog = later(async () => (await import("./tools")).ToolsDialog);

export function Shortcuts(): JSX.Element {
  const open = useSignal<"" | "fire" | "warm" | "edit" | "tools">("");
  const edited = useSignal(-1);
  const edit = (index: number): void => void ([edited.value, open.value] = [index, "edit"]);
  const close = (): void => void (open.value = "");
  const laser = isLaser(standing.value.settings);
  return (
    <Card
      title={t`Shortcuts`}
      tools={
        <>
          {macros.value.length > 0 && (
            <Button size="small" kind="danger" icon="stop" machine="stops" disabled={!doing.value} onClick={stopMacro} testId="macro-stop">
              {t`Stop the macro`}
            </Button>
          )}
          <Button size="small" disabled={macros.value.length >= MOST_MACROS} onClick={() => edit(macros.value.length)} testId="macro-new">
            {t`New macro`}
          </Button>
        </>
      }
    >
      <div class="row">
        <StoredPosition name="G28" />
        <StoredPosition name="G30" />
        <Button why={noMotion.value} onClick={() => (open.value = laser ? "fire" : "warm")} testId={laser ? "fire" : "warm"}>
          {laser ? t`Test laser` : t`Warm up spindle`}
        </Button>
        <Button why={noMotion.value} onClick={() => (open.value = "tools")} testId="tools-open">
          {t`Tool table`}
        </Button>
      </div>
      {macros.value.length > 0 && (
        <div class="row">
          {macros.value.map((macro, i) => (
            <span key={i} class="pair" role="group" aria-label={macro.name}>
              <Button
                machine="starts"
                why={macroMoves(macro) ? noMotion.value : noHoming.value}
                title={macro.lines}
                onClick={() => void attempt(() => runMacro(macro))}
                testId={`macro-${i}`}
              >
                {macro.name}
              </Button>
              <Button label={t`Change ${macro.name}`} title={t`Change ${macro.name}`} onClick={() => edit(i)} testId={`macro-edit-${i}`}>
                …
              </Button>
            </span>
          ))}
        </div>
      )}
      {open.value === "fire" && <FireDialog onClose={close} />}
      {open.value === "warm" && <WarmDialog onClose={close} />}
      {open.value === "tools" && <ToolsDialog onClose={close} />}
      {open.value === "edit" && <MacroDialog index={edited.value} onClose={close} />}
    </Card>
  );
}

function StoredPosition({ name }: { name: StoredName }): JSX.Element {
  const asks = useSignal(false);
  const place = standing.value.offsets.get(name);
  const text = place ? place.slice(0, controller.axisCount.value).map((value) => value.toFixed(3)).join(", ") : t`not reported`;
  const set = async (): Promise<void> => {
    await controller.send(`${name}.1`);
    await controller.refresh("$#");
  };
  return (
    <span class="pair" role="group" aria-label={t`Stored position ${name}`}>
      <Button
        machine="starts"
        why={noMotion.value}
        title={t`Raise Z, move to X and Y of ${name}, then to its Z. Machine position: ${text}`}
        onClick={() => void attempt(() => goBy(() => planStored(name, standing.peek().offsets.get(name), zeroFacts())))}
        testId={`go-${name}`}
      >
        {t`Go to ${name}`}
      </Button>
      <Button why={noMotion.value || unknownPlace(zeroFacts())} label={t`Set ${name}`} title={t`Store this position as ${name}`} onClick={() => (asks.value = true)} testId={`set-${name}`}>
        {t`Set`}
      </Button>
      {asks.value && (
        <Dialog title={t`Store this position as ${name}?`} onClose={() => (asks.value = false)}>
          <p>{t`The position that is stored now, in machine coordinates: ${text}.`}</p>
          <div class="row">
            <Button kind="primary" why={noMotion.value} onClick={() => ((asks.value = false), void attempt(set))} testId={`store-${name}`}>
              {t`Store`}
            </Button>
            <Button onClick={() => (asks.value = false)}>{t`Cancel`}</Button>
          </div>
        </Dialog>
      )}
    </span>
  );
}

const NAME_LENGTH = 24;

/** What is wrong with a macro; "": nothing. */
function problemOf(macro: Macro): string {
  if (macro.name.trim() === "") return t`A macro needs a name.`;
  try {
    macroLines(macro);
    return "";
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

function MacroDialog({ index, onClose }: { index: number; onClose: () => void }): JSX.Element {
  const macro = useSignal<Macro>(macros.peek()[index] ?? { name: "", lines: "" });
  const problem = problemOf(macro.value);
  const replace = (...by: Macro[]): void => {
    keepMacros(macros.peek().toSpliced(index, 1, ...by));
    onClose();
  };
  return (
    <Dialog title={index < macros.value.length ? t`Change this macro` : t`New macro`} onClose={onClose}>
      <Field label={t`Name`}>
        <input class="input" maxLength={NAME_LENGTH} value={macro.value.name} onInput={(event) => (macro.value = { ...macro.value, name: event.currentTarget.value })} data-test="macro-name" />
      </Field>
      <Field label={t`Lines`} hint={t`G-code and $ commands, one after the other. Stored in this browser. The modes that they change stay changed.`}>
        <textarea class="input mono" rows={6} spellcheck={false} value={macro.value.lines} onInput={(event) => (macro.value = { ...macro.value, lines: event.currentTarget.value })} data-test="macro-lines" />
      </Field>
      {problem && macro.value.lines && <p class="small" role="status">{problem}</p>}
      <div class="row">
        <Button kind="primary" why={problem} onClick={() => replace({ ...macro.value, name: macro.value.name.trim() })} testId="macro-save">
          {t`Save`}
        </Button>
        {index < macros.value.length && (
          <Button kind="danger" onClick={() => replace()} testId="macro-delete">
            {t`Delete`}
          </Button>
        )}
        <Button onClick={onClose}>{t`Cancel`}</Button>
      </div>
    </Dialog>
  );
}
