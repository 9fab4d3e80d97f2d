/**
 * The firmware next to this page: `firmware/index.json` (`wificnc release` writes it) and ESP Web Tools' manifests.
 * Everything is checked before a byte goes to a board, and an error says what is wrong and what to do.
 */
import type { Board } from "../tables";
import { msg, t, tr } from "../words";

export interface FirmwareIndex {
  schema: number;
  version: string;
  revision: string;
  boards: IndexRow[];
}

export interface IndexRow {
  id: string;
  /** Why there is no firmware for this board here; null: there is. */
  missing: string | null;
  manifests: { path: string; flash_mb: number | null; memory_mode: string }[];
  files: { path: string; size: number; sha256: string }[];
}

export interface Part {
  name: string;
  offset: number;
  data: Uint8Array;
}

export interface Firmware {
  board: Board;
  name: string;
  version: string;
  chipFamily: string;
  /** Flash that it needs, MB. */
  flashMb: number;
  parts: Part[];
}

export class FirmwareError extends Error {
  constructor(
    message: string,
    readonly hint = "",
  ) {
    super(message);
  }
}

const SCHEMA = 1;
const FOLDER = "firmware/";
const AGAIN = msg`Reload the page; if that does not help, its files are from different releases.`;

/** Whatever gets a file of this page; tests have their own. */
export type Fetch = (path: string) => Promise<Response>;

const fetchHere: Fetch = (path) => fetch(new URL(path, document.baseURI));

/** null: there is no firmware next to this page. Rejects with a FirmwareError. */
export async function loadIndex(get: Fetch = fetchHere): Promise<FirmwareIndex | null> {
  const answer = await get(`${FOLDER}index.json`).catch(() => null);
  if (!answer || answer.status === 404) return null;
  const index = (await json(answer, t`the list of firmware`)) as FirmwareIndex;
  if (index.schema !== SCHEMA || !Array.isArray(index.boards))
    throw new FirmwareError(t`The list of firmware has format ${index.schema}, and this page supports ${SCHEMA}`, tr(AGAIN));
  return index;
}

/** Manifest and parts of a board, all checked. Rejects with a FirmwareError. */
export async function loadFirmware(index: FirmwareIndex, board: Board, get: Fetch = fetchHere): Promise<Firmware> {
  const row = index.boards.find((entry) => entry.id === board.id);
  const build = row?.manifests[0];
  if (!row || !build) throw new FirmwareError(t`No firmware for ${tr(board.name)} on this page`, row?.missing ?? "");
  const manifest = await checkedJson(row, build.path, get);
  const { name, version, builds } = manifest as { name?: unknown; version?: unknown; builds?: unknown };
  const first: unknown = Array.isArray(builds) ? builds[0] : undefined;
  const { chipFamily, parts } = (first ?? {}) as { chipFamily?: unknown; parts?: unknown };
  if (typeof name !== "string" || typeof version !== "string" || typeof chipFamily !== "string" || !Array.isArray(parts))
    throw new FirmwareError(t`${build.path} is not an ESP Web Tools manifest`, tr(AGAIN));
  const folder = build.path.replace(/[^/]*$/, "");
  const loaded = await Promise.all(parts.map((part: unknown) => loadPart(row, folder, part, get)));
  if (chipFamily.replace(/-/g, "").toLowerCase() !== board.chip)
    throw new FirmwareError(t`This firmware is for an ${chipFamily}, and ${tr(board.name)} has an ${board.chip_name}`, tr(AGAIN));
  return { board, name, version, chipFamily, flashMb: build.flash_mb ?? 0, parts: loaded };
}

async function loadPart(row: IndexRow, folder: string, part: unknown, get: Fetch): Promise<Part> {
  const { path, offset } = (part ?? {}) as { path?: unknown; offset?: unknown };
  if (typeof path !== "string" || typeof offset !== "number" || offset < 0 || !Number.isInteger(offset))
    throw new FirmwareError(t`The manifest has a part without path or offset`, tr(AGAIN));
  return { name: path, offset, data: await checked(row, folder + path, get) };
}

async function checkedJson(row: IndexRow, path: string, get: Fetch): Promise<unknown> {
  try {
    return JSON.parse(new TextDecoder().decode(await checked(row, path, get)));
  } catch (error) {
    if (error instanceof FirmwareError) throw error;
    throw new FirmwareError(t`${path} is damaged: ${error instanceof Error ? error.message : error}`, tr(AGAIN));
  }
}

/** A file that has the size and the sum of the list. */
async function checked(row: IndexRow, path: string, get: Fetch): Promise<Uint8Array> {
  const wanted = row.files.find((file) => file.path === path);
  if (!wanted) throw new FirmwareError(t`${path} is not in the list of firmware`, tr(AGAIN));
  const answer = await get(FOLDER + path).catch(() => null);
  if (!answer?.ok) throw new FirmwareError(t`${path} is missing${answer ? ` (${answer.status})` : ""}`, tr(AGAIN));
  const data = new Uint8Array(await answer.arrayBuffer());
  if (data.length !== wanted.size)
    throw new FirmwareError(t`${path} is damaged: ${data.length} bytes instead of ${wanted.size}`, tr(AGAIN));
  if ((await sha256(data)) !== wanted.sha256) throw new FirmwareError(t`${path} is damaged: its SHA-256 differs`, tr(AGAIN));
  return data;
}

async function json(answer: Response, what: string): Promise<unknown> {
  if (!answer.ok) throw new FirmwareError(t`${what} cannot be read: ${answer.status}`, tr(AGAIN));
  try {
    return await answer.json();
  } catch {
    throw new FirmwareError(t`${what} is damaged`, tr(AGAIN));
  }
}

async function sha256(data: Uint8Array): Promise<string> {
  const digest = await crypto.subtle.digest("SHA-256", data as Uint8Array<ArrayBuffer>);
  return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
