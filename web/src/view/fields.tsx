/** Settings in a form of a few: each with its name, its unit and what it does. */
import type { JSX } from "preact";
import { controller } from "../app";
import { findSetting, settingName, settingProblem } from "../tables";
import { Field } from "./parts";
import { tr } from "../words";

/** $N -> what was typed. */
export type Edits = ReadonlyMap<number, string>;

export interface SettingFieldProps {
  number: number;
  edits: Edits;
  onEdit: (number: number, text: string) => void;
  /** Values by name; without, it is typed. */
  choices?: readonly (readonly [value: string, text: string])[];
  /** Instead of the setting's own. */
  label?: string;
  hint?: string;
}

/** What is typed, or what the controller has. */
export function textOf(number: number, edits: Edits): string {
  return edits.get(number) ?? controller.settings.value.get(number) ?? "";
}

/** Of these settings, one has no possible value. */
export function anyProblem(edits: Edits): boolean {
  return [...edits].some(([number, text]) => settingProblem(findSetting(number)!.row, text) !== "");
}

export function SettingField({ number, edits, onEdit, choices, label, hint }: SettingFieldProps): JSX.Element | null {
  const row = findSetting(number)?.row;
  if (!row || !controller.settings.value.has(number)) return null;
  const text = textOf(number, edits);
  const problem = settingProblem(row, text);
  const shown = { class: "input", value: Number(text), disabled: !controller.commands.value, "data-test": `field-${number}` };
  return (
    <Field label={label ?? `${settingName(row)}${row.unit ? `, ${tr(row.unit)}` : ""}`} hint={problem || (hint ?? (choices ? "" : tr(row.help)))}>
      {choices ? (
        <select {...shown} onChange={(event) => onEdit(number, event.currentTarget.value)}>
          {choices.map(([value, name]) => (
            <option key={value} value={value}>
              {name}
            </option>
          ))}
        </select>
      ) : (
        <input {...shown} value={text} inputMode="decimal" aria-invalid={problem !== ""} onInput={(event) => onEdit(number, event.currentTarget.value)} />
      )}
    </Field>
  );
}
