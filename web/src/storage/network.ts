/** Pins of the controller that serves this page, read and changed over the network: /api/pins (targets/esp32/net/wiring_page.h). */
import { reachNew } from "../flash/update";
import { FirmwareError } from "../flash/manifest";
import { TABLES, type Board } from "../tables";
import { changes, networkPins, ownPin } from "./board";
import { t, tr } from "../words";

interface Told {
  may?: boolean;
  pins?: Record<string, number>;
  error?: string;
  field?: string;
}

const rows = TABLES.storage.pin;

async function call(init?: RequestInit): Promise<Told> {
  const answer = await fetch(new URL("./api/pins", document.baseURI), init).catch(() => null);
  if (!answer) throw new FirmwareError(t`The controller cannot be reached`, t`Check that it is on and on this network.`);
  if (!answer.headers.get("content-type")?.includes("json")) throw new FirmwareError(t`The controller does not move pins over the network`, "Use USB.");
  const told = (await answer.json()) as Told;
  if (answer.ok) return told;
  const row = rows.find((each) => each.key === told.field);
  throw new FirmwareError(t`The controller refuses: ${row ? `${tr(row.label)}: ` : ""}${told.error ?? answer.status}`, t`Nothing was changed.`);
}

/** Rejects with a FirmwareError. */
export async function readNetworkPins(board: Board): Promise<void> {
  const { pins = {} } = await call();
  networkPins.value = new Map(rows.flatMap((row) => (row.key in pins && pins[row.key] !== ownPin(board, row) ? [[row.key, pins[row.key]!] as const] : [])));
}

/** What is changed here and can be sent: key -> pin. */
export function changedPins(board: Board): Map<string, number> {
  return new Map(rows.flatMap((row) => (changes.value.has(row.key) ? [[row.key, Number(changes.value.get(row.key) ?? ownPin(board, row))] as const] : [])));
}

/** Store them, restart, and log in, so that they stay. Rejects with a FirmwareError: nothing is changed, or the old ones return. */
export async function writeNetworkPins(board: Board, key: string): Promise<void> {
  const pins = changedPins(board);
  const body = JSON.stringify({ ...Object.fromEntries(pins), restart: true, key });
  await call({ method: "POST", headers: { "Content-Type": "application/json" }, body });
  await reachNew(key, "pins");
  await readNetworkPins(board);
  const isOld = rows.some((row) => pins.has(row.key) && (networkPins.value?.get(row.key) ?? ownPin(board, row)) !== pins.get(row.key));
  if (isOld) throw new FirmwareError(t`The pins before have returned`, t`The controller has restarted again before it was reached. Store them again.`);
  changes.value = new Map([...changes.value].filter(([name]) => !pins.has(name)));
}
