/**
 * A new firmware for the controller that serves this page: the sender's side of targets/esp32/net/ota.h, over a WebSocket.
 * What can be checked here is checked before a byte is sent; the controller checks all of it again.
 */
import { hmac } from "@noble/hashes/hmac.js";
import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex, utf8ToBytes } from "@noble/hashes/utils.js";
import { keySecret, loginProof } from "../link/login";
import { FirmwareError } from "./manifest";
import { msg, t, tr } from "../words";

export interface Update {
  name: string;
  data: Uint8Array<ArrayBuffer>;
  /** Two numbers of 32 bytes. */
  signature: Uint8Array;
  /** It may be for another board than the controller's. */
  anyBoard: boolean;
}

/** A file that was chosen. */
export interface NamedFile {
  name: string;
  data: Uint8Array<ArrayBuffer>;
}

const IMAGE_MAGIC = 0xe9;
const HALF = 32;
const CHUNK = 16384;
/** That wait in the browser at most: a refusal is seen before the rest is sent. */
const AHEAD = 4 * CHUNK;
const WAIT_MS = 20;
/** Of the controller: a sector is erased meanwhile. */
const ANSWER_MS = 20_000;
const RESTART_MS = 3000;
const BACK_MS = 90_000;
/** Of a new firmware (targets/esp32/net/update_trial.h). */
const TRIAL_MS = 300_000;
/** app_elf_sha256 of esp_app_desc_t in an image, and how much of it the controller reports. */
const DIGEST_AT = 176;
const DIGEST_SIZE = 8;
const AGAIN_MS = 1000;

const WHICH = msg`A release has them as …-BOARD-firmware.bin and …-BOARD-firmware.sig, \`wificnc build\` as firmware.bin and firmware.sig.`;
const HINTS: readonly [string | RegExp, string][] = [
  ["access key", msg`It is shown over USB. Case, dashes and spaces do not matter.`],
  ["not signed", msg`An update comes from who has built the firmware that runs (docs/security.md).`],
  ["another chip", WHICH],
  ["another product", WHICH],
  ["damaged", msg`Send it again.`],
  [/on trial/, msg`Send it again in half a minute.`],
  [/another sender/, msg`Send it again.`],
];

/**
 * An image and its signature, and perhaps the list of their release. Throws a FirmwareError.
 * @param anyBoard  another board is meant
 */
export function readUpdate(files: readonly NamedFile[], board: string, anyBoard = false): Update {
  const image = only(files, ".bin", "firmware");
  const signature = rawSignature(only(files, ".sig", "signature"));
  if (image.data[0] !== IMAGE_MAGIC) throw new FirmwareError(t`${image.name} is not a firmware image of an ESP32`, tr(WHICH));
  const made = boardOf(image.data);
  if (made === null) throw new FirmwareError(t`${image.name} is not a firmware of WiFiCNC`, tr(WHICH));
  if (made !== board && !anyBoard)
    throw new FirmwareError(t`${image.name} is for the board ${made}, and this controller is a ${board}`, t`Choose the firmware of ${board}, or allow one for another board.`);
  for (const list of files.filter((file) => file.name.endsWith(".json"))) checkByList(list, image);
  return { name: image.name, data: image.data, signature, anyBoard };
}

function only(files: readonly NamedFile[], end: string, what: string): NamedFile {
  const [first, ...more] = files.filter((file) => file.name.endsWith(end));
  if (!first) throw new FirmwareError(t`The ${what} is missing: choose two files, one that ends with .bin and one with .sig`, tr(WHICH));
  if (more.length > 0) throw new FirmwareError(t`There are ${more.length + 1} files that end with ${end}: choose one`, tr(WHICH));
  return first;
}

/** The two numbers of a DER sequence (RFC 3279, 2.2.3). */
function rawSignature(file: NamedFile): Uint8Array {
  const der = file.data;
  const raw = new Uint8Array(2 * HALF);
  let at = 2;
  for (const half of [0, 1]) {
    const size = der[at + 1] ?? 0;
    const number = der.subarray(at + 2, at + 2 + size);
    const digits = number[0] === 0 ? number.subarray(1) : number;
    if (der[at] !== 2 || size === 0 || number.length !== size || digits.length > HALF) throw notSigned(file);
    raw.set(digits, (half + 1) * HALF - digits.length);
    at += 2 + size;
  }
  if (der[0] !== 0x30 || der[1] !== der.length - 2 || at !== der.length) throw notSigned(file);
  return raw;
}

function notSigned(file: NamedFile): FirmwareError {
  return new FirmwareError(t`${file.name} is not a signature of a firmware`, tr(WHICH));
}

/** The id in what the firmware answers to GET api/controller (targets/esp32/net/page.c). */
function boardOf(data: Uint8Array): string | null {
  const mark = utf8ToBytes('"board": "');
  for (let at = data.indexOf(mark[0]!); at >= 0; at = data.indexOf(mark[0]!, at + 1)) {
    if (!mark.every((byte, i) => data[at + i] === byte)) continue;
    const found = /^[a-z0-9-]+(?=")/.exec(new TextDecoder("latin1").decode(data.subarray(at + mark.length, at + mark.length + 64)));
    if (found) return found[0];
  }
  return null;
}

interface Listed {
  path?: unknown;
  size?: unknown;
  sha256?: unknown;
}

/** firmware/index.json of a release. */
function checkByList(list: NamedFile, image: NamedFile): void {
  let boards: unknown;
  try {
    boards = (JSON.parse(new TextDecoder().decode(list.data)) as { boards?: unknown }).boards;
  } catch {
    throw new FirmwareError(t`${list.name} is damaged: it is not JSON`);
  }
  const rows = (Array.isArray(boards) ? boards : []).flatMap((row: { files?: Listed[] }) => row.files ?? []);
  const wanted = rows.find((row) => typeof row.path === "string" && row.path.replace(/^.*\//, "") === image.name);
  if (!wanted) throw new FirmwareError(t`${list.name} does not list ${image.name}`, t`Both must be of one release, and keep their names.`);
  if (wanted.size !== image.data.length || wanted.sha256 !== bytesToHex(sha256(image.data)))
    throw new FirmwareError(t`${image.name} is damaged: ${list.name} has another size or SHA-256`, t`Download it again.`);
}

// ---- the connection ----

/** What a WebSocket says, line by line. */
class Lines {
  private said = "";
  private ended = false;
  private wake: () => void = () => undefined;

  constructor(readonly socket: WebSocket) {
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => {
      this.said += new TextDecoder("latin1").decode(event.data as ArrayBuffer);
      this.wake();
    };
    socket.onclose = () => {
      this.ended = true;
      this.wake();
    };
  }

  /** The next line; null: it has none now. */
  take(): string | null {
    const end = this.said.indexOf("\n");
    if (end < 0) return null;
    const line = this.said.slice(0, end).replace(/\r$/, "");
    this.said = this.said.slice(end + 1);
    return line;
  }

  /** Rejects with a FirmwareError when none comes. */
  async next(): Promise<string> {
    for (;;) {
      const line = this.take();
      if (line !== null) return line;
      if (this.ended) throw new FirmwareError(t`The connection to the controller was lost`, t`The old firmware still runs: send it again.`);
      await new Promise<void>((resolve, reject) => {
        const timer = setTimeout(() => reject(new FirmwareError(t`The controller has stopped answering`, t`The old firmware still runs: send it again.`)), ANSWER_MS);
        this.wake = () => {
          clearTimeout(timer);
          resolve();
        };
      });
    }
  }
}

/** A line that is no refusal. */
function good(line: string): string {
  if (!line.startsWith("ERROR ")) return line;
  const why = line.slice("ERROR ".length);
  throw new FirmwareError(t`The controller refuses the update: ${why}`, tr(HINTS.find(([word]) => why.match(word))?.[1] ?? ""));
}

function address(path: string): string {
  const url = new URL(path, location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}

/** What it says first. */
interface Hello {
  nonce: string;
  salt: string;
  rounds: number;
  /** Of the firmware that runs; "": an older one, which does not report it. */
  digest: string;
  onTrial: boolean;
}

async function greet(lines: Lines): Promise<Hello> {
  const [name, version, , nonce, salt, rounds, digest = "", state] = good(await lines.next()).split(" ");
  if (name !== "WIFICNC-OTA" || version !== "3" || !nonce || !salt) throw new FirmwareError(t`The controller does not support the updates of this page`);
  return { nonce, salt, rounds: Number(rounds), digest, onTrial: state === "trial" };
}

/** The line with the proof that its sender knows the key. */
async function request(lines: Lines, hello: Hello, key: string, words: string): Promise<void> {
  const proof = hmac(sha256, keySecret(key, hello.salt, hello.rounds), utf8ToBytes(`${hello.nonce} ${words}`));
  lines.socket.send(utf8ToBytes(`${words} ${bytesToHex(proof)}\n`));
  good(await lines.next());
}

/** Send it, and wait until the controller has checked and installed it. Rejects with a FirmwareError. */
export async function sendUpdate(update: Update, key: string, progress: (share: number) => void): Promise<void> {
  const lines = new Lines(new WebSocket(address("./update")));
  try {
    const words = `${update.data.length} ${bytesToHex(sha256(update.data))} ${bytesToHex(update.signature)}${update.anyBoard ? " any-board" : ""}`;
    await request(lines, await greet(lines), key, words);
    await sendImage(lines, update.data, progress);
  } finally {
    lines.socket.close();
  }
}

async function sendImage(lines: Lines, data: Uint8Array<ArrayBuffer>, progress: (share: number) => void): Promise<void> {
  const look = (line: string): boolean => {
    const at = /^AT (\d+)$/.exec(good(line))?.[1];
    if (at !== undefined) progress(Number(at) / data.length);
    return line === "DONE";
  };
  for (let at = 0; at < data.length; at += CHUNK) {
    while (lines.socket.bufferedAmount > AHEAD && lines.socket.readyState === WebSocket.OPEN) await pause(WAIT_MS);
    for (let line = lines.take(); line !== null; line = lines.take()) look(line);
    if (lines.socket.readyState !== WebSocket.OPEN) break; // next() has the reason, or reports the loss
    lines.socket.send(data.subarray(at, at + CHUNK));
  }
  while (!look(await lines.next()));
  progress(1);
}

function pause(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}

/** Which firmware runs; one of this digest that is on trial is confirmed. Rejects when none answers. */
async function running(key: string, digest: string): Promise<Hello> {
  const lines = new Lines(new WebSocket(address("./update")));
  try {
    const hello = await greet(lines);
    if (hello.onTrial && hello.digest === digest) await request(lines, hello, key, "confirm");
    return hello;
  } finally {
    lines.socket.close();
  }
}

/**
 * Have the new firmware confirmed, and wait until it is, so that it also survives the power switch. Rejects with a FirmwareError
 * when another one answers, or none does.
 * @param onTrial  it runs, and is not confirmed yet
 */
export async function waitUntilKept(update: Update, key: string, onTrial: () => void): Promise<void> {
  const digest = bytesToHex(update.data.subarray(DIGEST_AT, DIGEST_AT + DIGEST_SIZE));
  const started = performance.now();
  let heard = started;
  for (;;) {
    const hello = await running(key, digest).catch(() => null);
    if (hello && hello.digest !== digest) throw returned(hello);
    if (hello && !hello.onTrial) return;
    const now = performance.now();
    if (hello) {
      heard = now;
      onTrial();
    }
    if (now - heard > BACK_MS || now - started > TRIAL_MS) throw lost("firmware");
    await pause(AGAIN_MS);
  }
}

function returned(hello: Hello): FirmwareError {
  if (!hello.digest) return new FirmwareError(t`The controller does not report which firmware runs`, t`Open this page again and compare the version.`);
  return new FirmwareError(t`The old firmware has returned`, t`The new one has crashed, or the power was off before it was kept. Send it again.`);
}

function lost(what: string): FirmwareError {
  return new FirmwareError(
    t`The controller does not come back with the new ${what}`,
    t`What was there before returns 5 minutes after the start. Then open this page again.`,
  );
}

/** Log in after a restart, so that what is new stays (net/update_trial.h). Rejects with a FirmwareError when it does not come back. */
export async function reachNew(key: string, what: string): Promise<void> {
  const until = performance.now() + BACK_MS;
  await pause(RESTART_MS);
  while (performance.now() < until) {
    if (await logsIn(key).catch(() => false)) return;
    await pause(AGAIN_MS);
  }
  throw lost(what);
}

async function logsIn(key: string): Promise<boolean> {
  const lines = new Lines(new WebSocket(address("./grbl")));
  try {
    await new Promise((resolve, reject) => {
      lines.socket.addEventListener("open", resolve);
      lines.socket.addEventListener("close", reject);
    });
    const question = await ask(lines, "$LOGIN");
    const proof = loginProof(key, question);
    return (proof === null ? question : await ask(lines, `$LOGIN=${proof}`)).includes("ok");
  } finally {
    lines.socket.close();
  }
}

/** What comes up to the answer. */
async function ask(lines: Lines, line: string): Promise<string[]> {
  lines.socket.send(utf8ToBytes(`${line}\n`));
  const said = [await lines.next()];
  while (!/^(ok$|error:)/.test(said.at(-1)!)) said.push(await lines.next());
  return said;
}
