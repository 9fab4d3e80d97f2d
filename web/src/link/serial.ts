/** A serial port by the browser's own Web Serial API: Chrome, Edge and Opera on computers. */
import { LinkError, type Transport, type TransportEvents } from "./transport";
import { t } from "../words";

/** Of the firmware's UART0; native USB ports do not care. */
export const BAUD = 115200;

export function hasWebSerial(): boolean {
  return "serial" in navigator;
}

/** Let the user pick a port. Rejects with a LinkError; null: the user has changed their mind. */
export async function pickPort(): Promise<SerialPort | null> {
  if (!hasWebSerial())
    throw new LinkError(
      t`This browser does not support serial ports`,
      window.isSecureContext
        ? t`Use Chrome, Edge or Opera on a computer.`
        : t`Serial ports need a secure page: open it by https, or from this computer.`,
    );
  try {
    return await navigator.serial.requestPort();
  } catch (error) {
    if (error instanceof DOMException && error.name === "NotFoundError") return null;
    throw new LinkError(t`The browser did not grant access to a serial port`, String(error));
  }
}

export class SerialTransport implements Transport {
  readonly name = "USB serial port";
  readonly isSerial = true;
  private reader: ReadableStreamDefaultReader<Uint8Array> | null = null;
  private writer: WritableStreamDefaultWriter<Uint8Array> | null = null;
  private closing = false;
  private reading: Promise<void> = Promise.resolve();

  constructor(private readonly port: SerialPort) {}

  async open(events: TransportEvents): Promise<void> {
    try {
      await this.port.open({ baudRate: BAUD, bufferSize: 4096 });
    } catch (error) {
      throw new LinkError(
        t`The serial port cannot be opened`,
        t`Close other programs that use it, or reconnect the board. (${error instanceof Error ? error.message : error})`,
      );
    }
    if (!this.port.readable || !this.port.writable) throw new LinkError(t`The serial port is not readable and writable`);
    this.closing = false;
    this.reader = this.port.readable.getReader();
    this.writer = this.port.writable.getWriter();
    this.reading = this.read(this.reader, events);
  }

  async write(bytes: Uint8Array): Promise<void> {
    if (!this.writer) throw new LinkError(t`The serial port is closed`);
    await this.writer.write(bytes);
  }

  async close(): Promise<void> {
    this.closing = true;
    await this.reader?.cancel().catch(ignore);
    await this.reading;
    this.writer?.releaseLock();
    this.writer = null;
    await this.port.close().catch(ignore);
  }

  private async read(reader: ReadableStreamDefaultReader<Uint8Array>, events: TransportEvents): Promise<void> {
    let why = t`the port was closed`;
    try {
      for (;;) {
        const { value, done } = await reader.read();
        if (done) break;
        events.bytes(value);
      }
    } catch (error) {
      why = error instanceof Error ? error.message : String(error);
    }
    reader.releaseLock();
    this.reader = null;
    if (this.closing) return;
    this.writer?.releaseLock();
    this.writer = null;
    await this.port.close().catch(ignore);
    events.lost(why);
  }
}

/** A port that is gone cannot be closed; that is not news. */
function ignore(): void {}
