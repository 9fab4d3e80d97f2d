/** Give a board that runs the name and password of a WiFi network, over its serial port: Improv Wi-Fi. */
import { BAUD } from "../link/serial";

export interface Joined {
  /** Of the board. */
  name: string;
  firmware: string;
  /** Where it is found in that network; "": it does not say. */
  address: string;
}

export class ProvisionError extends Error {
  constructor(
    message: string,
    readonly hint = "",
  ) {
    super(message);
  }
}

/** A board that starts when its port is opened needs a moment. */
const HELLO_MS = 6000;
/** The board itself gives up after 30 seconds. */
const JOIN_MS = 40_000;

const REASONS: Record<string, [string, string]> = {
  UNABLE_TO_CONNECT: ["The board cannot connect to this network", "Is the password right? The board knows 2.4 GHz only."],
  INVALID_RPC_PACKET: ["The board refuses this name or password", "A password has 8 to 63 characters, or none at all."],
  UNKNOWN_ERROR: ["The board cannot join a network now", "The machine must stand still."],
};

const quiet = { log: () => {}, error: () => {}, debug: () => {} };

/** Join this network, which the board then keeps. Rejects with a ProvisionError. */
export async function joinNetwork(port: SerialPort, network: string, password: string): Promise<Joined> {
  const { ImprovSerial } = await import("improv-wifi-serial-sdk/dist/serial.js");
  try {
    await port.open({ baudRate: BAUD, bufferSize: 4096 });
  } catch {
    throw new ProvisionError("The serial port cannot be opened", "Is another program using it?");
  }
  const board = new ImprovSerial(port, quiet);
  try {
    const info = await board.initialize(HELLO_MS).catch(() => {
      throw new ProvisionError("The board does not answer", "Is WiFiCNC installed on it? Press its reset button and try again.");
    });
    await board.provision(network, password, JOIN_MS);
    return { name: info?.name ?? "", firmware: `${info?.firmware} ${info?.version}`, address: board.nextUrl ?? "" };
  } catch (error) {
    if (error instanceof ProvisionError) throw error;
    const [title, hint] = REASONS[error instanceof Error ? error.message : String(error)] ?? [String(error), ""];
    throw new ProvisionError(title, hint);
  } finally {
    await board.close().catch(() => {});
    await port.close().catch(() => {}); // it may be unplugged
  }
}
