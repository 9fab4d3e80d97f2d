/** Give a board that runs the name and password of a WiFi network, over its serial port: Improv Wi-Fi. */
import type { ImprovSerial } from "improv-wifi-serial-sdk/dist/serial.js";
import { BAUD } from "../link/serial";
import { msg, t, tr } from "../words";

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
/** ... and here after 15. */
const SCAN_MS = 20_000;

const REASONS: Record<string, [string, string]> = {
  UNABLE_TO_CONNECT: [msg`The board cannot connect to this network`, msg`Check the password. The board supports 2.4 GHz only.`],
  INVALID_RPC_PACKET: [msg`The board rejected this name or password`, msg`A password has 8 to 63 characters; an open network has none.`],
  UNKNOWN_ERROR: [msg`The board cannot join or search for a network now`, msg`The machine must be stopped, and WiFi must be on.`],
};

const quiet = { log: () => {}, error: () => {}, debug: () => {} };

/** Join this network, which the board then keeps. Rejects with a ProvisionError. */
export function joinNetwork(port: SerialPort, network: string, password: string): Promise<Joined> {
  return withBoard(port, async (board, info) => {
    await board.provision(network, password, JOIN_MS);
    return { name: info?.name ?? "", firmware: `${info?.firmware} ${info?.version}`, address: board.nextUrl ?? "" };
  });
}

export interface Network {
  name: string;
  rssi_dbm: number;
  secured: boolean;
}

/** The networks that the board hears, the strongest first. Rejects with a ProvisionError. */
export function findNetworks(port: SerialPort): Promise<Network[]> {
  return withBoard(port, async (board) => {
    const found = await board.scan(SCAN_MS);
    return found.map(({ name, rssi, secured }) => ({ name, rssi_dbm: rssi, secured })).sort((a, b) => b.rssi_dbm - a.rssi_dbm);
  });
}

/** Talk with the board at this port, and close it whatever happens. */
async function withBoard<T>(port: SerialPort, talk: (board: ImprovSerial, info: ImprovSerial["info"]) => Promise<T>): Promise<T> {
  const { ImprovSerial } = await import("improv-wifi-serial-sdk/dist/serial.js");
  try {
    await port.open({ baudRate: BAUD, bufferSize: 4096 });
  } catch {
    throw new ProvisionError(t`The serial port cannot be opened`, t`Check that no other program uses it.`);
  }
  const board = new ImprovSerial(port, quiet);
  try {
    const info = await board.initialize(HELLO_MS).catch(() => {
      throw new ProvisionError(t`The board does not answer`, t`Is WiFiCNC installed on it? Press its reset button and try again.`);
    });
    return await talk(board, info);
  } catch (error) {
    if (error instanceof ProvisionError) throw error;
    const [title, hint] = REASONS[error instanceof Error ? error.message : String(error)] ?? [String(error), ""];
    throw new ProvisionError(tr(title), tr(hint));
  } finally {
    await board.close().catch(() => {});
    await port.close().catch(() => {}); // it may be unplugged
  }
}
