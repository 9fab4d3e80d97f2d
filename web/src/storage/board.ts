/**
 * What an ESP32 has stored in addition to its settings (pins, networks, inputs): read over USB from its loader or from a file,
 * changed here, and written back with a restart. Nothing is written before someone says so.
 */
import { computed, signal } from "@preact/signals";
import { portForLoader } from "../app";
import { BoardDevice, type Progress } from "../flash/device";
import { pinRefusal, TABLES, type Board, type ChipPin, type StoredPin } from "../tables";
import { NvsImage, type StoredValue } from "./nvs";
import { t, tr } from "../words";

const { namespace, offset, size, none } = TABLES.storage;

/** As it was read; null: nothing was read yet. */
export const image = signal<NvsImage | null>(null);
/** Where it is from, for people. */
export const source = signal("");
/** Key -> new value; null: forget the key. */
export const changes = signal<ReadonlyMap<string, StoredValue | null>>(new Map());
/** Pins that a controller has told over the network, as far as they are not the board's own; null: none were asked for. */
export const networkPins = signal<ReadonlyMap<string, number> | null>(null);
/** 0..1 while the board is read or written. */
export const progress = signal<number | null>(null);
export const written = signal(false);

export const isChanged = computed(() => changes.value.size > 0);

/** The value with the changes made here; undefined: not stored. */
export function valueOf(key: string): StoredValue | undefined {
  const change = changes.value.get(key);
  if (change !== undefined) return change ?? undefined;
  return storedOf(key);
}

function storedOf(key: string): StoredValue | undefined {
  return image.value?.get(namespace, key) ?? networkPins.value?.get(key);
}

/** Change a key; null forgets it. */
export function setValue(key: string, value: StoredValue | null): void {
  const next = new Map(changes.value);
  const before = storedOf(key);
  if (value === before || (value === null && before === undefined)) next.delete(key);
  else next.set(key, value);
  changes.value = next;
  written.value = false;
}

export function forgetChanges(): void {
  changes.value = new Map();
}

/** Rejects with an NvsError for a file that is not a NVS partition. */
export async function openFile(file: File): Promise<void> {
  take(new NvsImage(new Uint8Array(await file.arrayBuffer())), file.name);
}

/** The partition as it will be. Throws NvsError when it has no room. */
export function changedImage(): NvsImage {
  const next = image.value ? new NvsImage(image.value.data) : NvsImage.blank(size);
  for (const [key, value] of changes.value) {
    if (value === null) next.remove(namespace, key);
    else next.set(namespace, key, value, TABLES.storage.number.find((row) => row.key === key)?.bits);
  }
  return next;
}

/** Over USB. Rejects with what to do. */
export async function readBoard(): Promise<void> {
  await withBoard(async (device, show) => {
    const data = await device.read(offset, size, show);
    take(new NvsImage(data), `${device.chip.family} ${device.chip.mac}`);
  });
}

/** Over USB; the board starts again with what was written. */
export async function writeBoard(): Promise<void> {
  const next = changedImage();
  await withBoard(async (device, show) => {
    await device.write([{ name: "settings", offset, data: next.data }], false, show);
    image.value = next;
    changes.value = new Map();
    written.value = true;
  });
}

async function withBoard(work: (device: BoardDevice, show: Progress) => Promise<void>): Promise<void> {
  const port = await portForLoader();
  if (!port) return;
  progress.value = 0;
  try {
    const device = await BoardDevice.open(port, () => {});
    try {
      await work(device, (_part, done, total) => (progress.value = total ? done / total : 0));
    } finally {
      await device.close();
    }
  } finally {
    progress.value = null;
  }
}

function take(next: NvsImage, from: string): void {
  image.value = next;
  source.value = from;
  changes.value = new Map();
  written.value = false;
}

// ---- pins ----

/** The pin that a signal has: stored, else the board's own. null: not wired. */
export function pinOf(board: Board, row: StoredPin): number | null {
  const stored = valueOf(row.key);
  const number = typeof stored === "number" ? stored : ownPin(board, row);
  return number === none ? null : number;
}

/** Of the board's own wiring. */
export function ownPin(board: Board, row: StoredPin): number {
  return board.uses.find((use) => use.signal === row.signal)?.number ?? none;
}

/** Whose pin it is, so that both can change places: either can have the other's. null: it is free, or they cannot. */
export function swapsWith(board: Board, row: StoredPin, pin: ChipPin): StoredPin | null {
  const rival = TABLES.storage.pin.find((other) => other.key !== row.key && pinOf(board, other) === pin.number);
  const own = board.pins.find((entry) => entry.number === pinOf(board, row));
  return rival && own && takes(board, row, pin) && takes(board, rival, own) ? rival : null;
}

/** Its own pin, or one that can do what it needs. */
function takes(board: Board, row: StoredPin, pin: ChipPin): boolean {
  return pin.number === ownPin(board, row) || (row.output ? pin.output : pin.input) === null;
}

/** The signal gets this pin, and whoever has it the pin that the signal has now. */
export function choosePin(board: Board, row: StoredPin, number: number): void {
  const pin = board.pins.find((entry) => entry.number === number);
  const rival = pin ? swapsWith(board, row, pin) : null;
  if (rival) keepPin(board, rival, pinOf(board, row) ?? none);
  keepPin(board, row, number);
}

function keepPin(board: Board, row: StoredPin, number: number): void {
  setValue(row.key, number === ownPin(board, row) ? null : number);
}

/** Why the firmware will not take this pin for this signal; "" when it will. The rules are the board's (tables.ts). */
export function refusal(board: Board, row: StoredPin, pin: ChipPin): string {
  if (pin.number === ownPin(board, row)) return "";
  const reason = pinRefusal(board, pin, row.output);
  if (reason !== null) return reason;
  const rival = TABLES.storage.pin.find((other) => other.key !== row.key && pinOf(board, other) === pin.number);
  if (rival) return t`${pin.name} is ${tr(rival.label)}`;
  const fixed = board.uses.find(
    (use) => use.number === pin.number && !TABLES.storage.pin.some((other) => other.signal === use.signal),
  );
  return fixed ? t`${pin.name} is ${tr(fixed.label)}` : "";
}

/** Every clash of the wiring as it would be, in words. */
export function clashes(board: Board): string[] {
  return TABLES.storage.pin.flatMap((row) => {
    const pin = board.pins.find((entry) => entry.number === pinOf(board, row));
    const why = pin ? refusal(board, row, pin) : "";
    return why ? [`${tr(row.label)}: ${why}`] : [];
  });
}
