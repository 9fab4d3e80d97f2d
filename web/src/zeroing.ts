/** Work zero by hand, with undo: for the positions of the tab Control and for the probing dialogs. */
import { computed, signal } from "@preact/signals";
import { controller, standing, stored, store, unknownYet } from "./app";
import { placeLine, undoLine, workSystemOf } from "./link/offsets";
import { settingNumber } from "./tables";
import { t } from "./words";

const REPORTS_IN_INCHES = settingNumber("report_inches");
const UNDO_DEPTH = 20;
const NAMES_KEY = "wificnc.work-systems";

interface Undo {
  text: string;
  line: string;
}

const undone = signal<readonly Undo[]>([]);
/** What Undo would take back; null: nothing. */
export const lastZero = computed(() => undone.value.at(-1) ?? null);
export const workSystem = computed(() => workSystemOf(controller.modes.value));
/** The controller has not reported yet which unit that is, and does not do so immediately. */
export const isUnitUnknown = computed(() => controller.settings.value.size === 0 && unknownYet.value !== "" && !["", "Idle"].includes(controller.state.value));
export const showsInches = computed(() => Number(controller.settings.value.get(REPORTS_IN_INCHES) ?? 0) > 0);

/** In mm, whatever the units of the program are. The modes of a parked job come back by themselves. */
export async function sayInMm(line: string): Promise<void> {
  if (controller.operates.value) {
    await controller.send(`G21${line}`);
    return;
  }
  await controller.refresh("$G");
  const inInches = controller.modes.value.split(" ").includes("G20");
  await controller.send(`G21${line}`);
  if (inInches) await controller.send("G20");
}

/** The axes are at these work positions, mm, from now on. Rejects with a RefusedError. */
export async function setPosition(values_mm: Readonly<Record<string, number>>, text: string): Promise<void> {
  const axes = Object.keys(values_mm);
  await controller.refresh("$#", "$G");
  const line = undoLine(workSystem.value, axes, standing.value.offsets.get(workSystem.value));
  await sayInMm(placeLine(values_mm));
  if (line) undone.value = [...undone.value, { text: t`${text} in ${workSystem.value}`, line }].slice(-UNDO_DEPTH);
  await controller.refresh("$#");
}

export async function undoZero(): Promise<void> {
  const last = undone.value.at(-1);
  if (!last) return;
  undone.value = undone.value.slice(0, -1); // a second press takes the one before
  try {
    await sayInMm(last.line);
  } catch (error) {
    undone.value = [...undone.value, last];
    throw error;
  }
  await controller.refresh("$#");
}

/** Names that the user gives work systems, kept in this browser. */
export const systemNames = signal<Readonly<Record<string, string>>>(readNames());

function readNames(): Record<string, string> {
  try {
    const kept: unknown = JSON.parse(stored(NAMES_KEY) ?? "{}");
    const rows = typeof kept === "object" && kept !== null ? Object.entries(kept) : [];
    return Object.fromEntries(rows.filter((row): row is [string, string] => typeof row[1] === "string"));
  } catch {
    return {};
  }
}

export function nameSystem(system: string, name: string): void {
  const { [system]: _, ...others } = systemNames.value;
  systemNames.value = name.trim() ? { ...others, [system]: name.trim() } : others;
  store(NAMES_KEY, JSON.stringify(systemNames.value));
}
