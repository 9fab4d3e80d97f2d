/** The channels of an I/O module, as the board has them stored: protocol/nvs.toml. Bit n of a mask is channel n. */
import { pinRefusal, TABLES, type Board, type StoredNumber } from "../tables";
import { setValue, valueOf } from "./board";
import { t } from "../words";

const { none } = TABLES.storage;

export interface Channel {
  number: number;
  output: boolean;
  /** null: none. */
  pin: number | null;
  pullUp: boolean;
  invert: boolean;
  /** On in the safe state. */
  safe: boolean;
}

const MASKS = { output: "io_dir", pullUp: "io_pull", invert: "io_invert", safe: "io_safe" } as const;

export function storedNumber(key: string): StoredNumber {
  return TABLES.storage.number.find((row) => row.key === key)!;
}

/** As it will be: stored and changed here, or the default. */
export function numberOf(key: string): number {
  return Number(valueOf(key) ?? storedNumber(key).default);
}

export function setNumber(key: string, value: number): void {
  const { min, max } = storedNumber(key);
  if (Number.isInteger(value)) setValue(key, Math.min(max, Math.max(min, value)));
}

export function isModule(): boolean {
  return numberOf("dev_mode") === 1;
}

/** Those in use. */
export function channels(): Channel[] {
  const bit = (key: string, n: number): boolean => ((numberOf(key) >> n) & 1) === 1;
  return Array.from({ length: numberOf("io_count") }, (_, n) => {
    const pin = numberOf(`io_p${n}`);
    return {
      number: n,
      output: bit(MASKS.output, n),
      pin: pin === none ? null : pin,
      pullUp: bit(MASKS.pullUp, n),
      invert: bit(MASKS.invert, n),
      safe: bit(MASKS.safe, n),
    };
  });
}

export function setPin(channel: number, pin: number | null): void {
  setNumber(`io_p${channel}`, pin ?? none);
}

export function setFlag(channel: number, flag: keyof typeof MASKS, on: boolean): void {
  const key = MASKS[flag];
  const mask = numberOf(key);
  setNumber(key, on ? mask | (1 << channel) : mask & ~(1 << channel));
}

/** Why the firmware leaves this channel out with that pin; "" when it does not. */
export function channelRefusal(board: Board, channel: Channel, pin: number): string {
  const chip = board.pins.find((entry) => entry.number === pin);
  if (!chip) return t`the board does not have pin ${pin}`;
  const reason = pinRefusal(board, chip, channel.output);
  if (reason !== null) return reason;
  if (board.uses.some((use) => use.signal === "led" && use.number === pin)) return t`${chip.name} is used by the LED`;
  const rival = channels().find((other) => other.number < channel.number && other.pin === pin);
  return rival ? t`${chip.name} is channel ${rival.number}'s` : "";
}

/** Every channel that would be left out, in words. */
export function moduleFaults(board: Board): string[] {
  if (!isModule()) return [];
  return channels().flatMap((channel) => {
    const why = channel.pin === null ? "" : channelRefusal(board, channel, channel.pin);
    return why ? [t`channel ${channel.number}: ${why}`] : [];
  });
}
