/** A board in its ROM's loader, over a serial port: esptool-js, loaded only when it is needed. */
import type { ESPLoader, Transport } from "esptool-js";
import type { Board } from "../tables";
import { FirmwareError, type Firmware } from "./manifest";
import { t, tr } from "../words";

const FAST_BAUD = 460800;
/** Embedded PSRAM of this size is octal, and takes GPIO33 to 37. */
const OCTAL_PSRAM = /PSRAM 8MB/;
const PSRAM_1V8 = /AP_1v8/;

export interface Chip {
  /** ESP32, ESP32-S3 */
  family: string;
  description: string;
  features: string[];
  mac: string;
  flashMb: number;
}

export type Log = (line: string) => void;
export type Progress = (part: string, done: number, total: number) => void;

export class BoardDevice {
  /** Rejects when the board was disconnected: the loader itself would continue asking for minutes. */
  private readonly lost: Promise<never>;

  private constructor(
    private readonly loader: ESPLoader,
    private readonly transport: Transport,
    readonly chip: Chip,
  ) {
    this.lost = new Promise((_resolve, reject) => {
      transport.device.addEventListener("disconnect", () => reject(new Error(t`the board was disconnected`)), { once: true });
    });
    this.lost.catch(() => {}); // it may be lost while no one waits
  }

  /** Reset the board into its loader and ask what it is. Rejects with a FirmwareError. */
  static async open(port: SerialPort, log: Log): Promise<BoardDevice> {
    const { ESPLoader, Transport } = await import("esptool-js");
    const transport = new Transport(port, false);
    const terminal = { clean: () => {}, write: () => {}, writeLine: log };
    const loader = new ESPLoader({ transport, baudrate: FAST_BAUD, terminal });
    try {
      const description = await loader.main();
      const size = await loader.detectFlashSize();
      const chip: Chip = {
        family: loader.chip.CHIP_NAME,
        description,
        features: await loader.chip.getChipFeatures(loader),
        mac: await loader.chip.readMac(loader),
        flashMb: parseSize(size),
      };
      return new BoardDevice(loader, transport, chip);
    } catch (error) {
      await transport.disconnect().catch(() => {});
      throw new FirmwareError(
        t`The board does not answer: ${words(error)}`,
        t`Hold BOOT while you press and release RESET, then try again. Check that no other program uses the port.`,
      );
    }
  }

  /** Before anything is written. @returns warnings. Throws FirmwareError. */
  check(firmware: Firmware): string[] {
    const { board } = firmware;
    if (this.chip.family !== firmware.chipFamily)
      throw new FirmwareError(
        t`This is an ${this.chip.family}, and ${tr(board.name)} has an ${board.chip_name}`,
        t`Choose the connected board. Is another board connected, too?`,
      );
    const end = Math.max(...firmware.parts.map((part) => part.offset + part.data.length));
    const needed = Math.max(firmware.flashMb, end / (1 << 20));
    if (this.chip.flashMb < needed)
      throw new FirmwareError(t`This board has ${this.chip.flashMb} MB of flash, and this firmware needs ${needed} MB`);
    return this.checkMemory(board);
  }

  /** Write all parts and compare what lies in the flash with them. Rejects with a FirmwareError. */
  async write(parts: Firmware["parts"], eraseAll: boolean, progress: Progress): Promise<void> {
    const { md5 } = await import("@noble/hashes/legacy.js");
    const { bytesToHex } = await import("@noble/hashes/utils.js");
    try {
      const writing = this.loader.writeFlash({
        fileArray: parts.map((part) => ({ data: part.data, address: part.offset })),
        flashSize: "keep",
        flashMode: "keep",
        flashFreq: "keep",
        eraseAll,
        compress: true,
        reportProgress: (index, written, total) => progress(parts[index]?.name ?? "", written, total),
        calculateMD5Hash: (image) => bytesToHex(md5(image)),
      });
      await this.unlessLost(writing);
    } catch (error) {
      throw new FirmwareError(
        t`Writing failed: ${words(error)}`,
        t`The firmware on the board may be incomplete. The boot loader is not affected: reconnect the board and install again.`,
      );
    }
  }

  async read(offset: number, size: number, progress: Progress): Promise<Uint8Array> {
    try {
      return await this.unlessLost(this.loader.readFlash(offset, size, (_packet, done, total) => progress("", done, total)));
    } catch (error) {
      throw new FirmwareError(t`Reading failed: ${words(error)}`, t`Reconnect the board.`);
    }
  }

  /** Start what is installed, and give the port back. */
  async close(restart = true): Promise<void> {
    if (restart) await this.unlessLost(this.loader.after()).catch(() => {});
    await this.unlessLost(this.transport.disconnect()).catch(() => {}); // an unplugged port cannot be closed
  }

  private unlessLost<T>(work: Promise<T>): Promise<T> {
    work.catch(() => {}); // what fails after the board is gone is not news
    return Promise.race([work, this.lost]);
  }

  private checkMemory(board: Board): string[] {
    const features = this.chip.features.join(" ");
    const octal = OCTAL_PSRAM.test(features);
    if (octal && PSRAM_1V8.test(features))
      throw new FirmwareError(t`This module's memory runs at 1.8 V, and so do its GPIO47 and 48: not a ${tr(board.name)}`);
    if (octal && !board.psram_mb.some((size) => size >= 8))
      throw new FirmwareError(t`This module has octal PSRAM, which takes GPIO33 to 37; ${tr(board.name)} is for quad memory`);
    if (!octal && this.chip.family === "ESP32-S3" && board.psram_mb.length > 0 && board.psram_mb.every((size) => size >= 8))
      return [t`No octal PSRAM in this module: the board for quad memory has more free pins.`];
    return [];
  }
}

function parseSize(text: string | undefined): number {
  const match = /^(\d+)(KB|MB)$/.exec(text ?? "");
  if (!match) return 0;
  return match[2] === "MB" ? Number(match[1]) : Number(match[1]) / 1024;
}

function words(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
