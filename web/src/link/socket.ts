/** A controller that serves this page, or another one by its address: Grbl's stream in a WebSocket. */
import { LinkError, type Transport, type TransportEvents } from "./transport";
import { t } from "../words";

const OPEN_MS = 5000;
/** WebSocket close codes of the server (cli/wificnc/simulator/serve/page.py). */
const CLOSED_BY_POLICY = 1008;

/** Where the server of this page has its stream. */
export function ownAddress(): string {
  const url = new URL("./grbl", location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}

export class SocketTransport implements Transport {
  readonly name: string;
  readonly isSerial = false;
  private socket: WebSocket | null = null;

  constructor(private readonly url: string) {
    this.name = new URL(url).host;
  }

  open(events: TransportEvents): Promise<void> {
    return new Promise((resolve, reject) => {
      const socket = new WebSocket(this.url);
      socket.binaryType = "arraybuffer";
      const timer = setTimeout(() => socket.close(), OPEN_MS);
      let opened = false;
      socket.onopen = () => {
        clearTimeout(timer);
        opened = true;
        this.socket = socket;
        resolve();
      };
      socket.onmessage = (event) => events.bytes(new Uint8Array(event.data as ArrayBuffer));
      socket.onclose = (event) => {
        clearTimeout(timer);
        if (!opened) {
          reject(new LinkError(t`No controller answers at ${this.name}`, t`Check that it is on and on this network.`));
          return;
        }
        if (this.socket !== socket) return;
        this.socket = null;
        events.lost(event.reason || (event.code === CLOSED_BY_POLICY ? "refused" : t`the connection was closed`));
      };
    });
  }

  write(bytes: Uint8Array): Promise<void> {
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.reject(new LinkError(t`The connection is closed`));
    this.socket.send(bytes as Uint8Array<ArrayBuffer>);
    return Promise.resolve();
  }

  close(): Promise<void> {
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    return Promise.resolve();
  }
}
