/**
 * The job of this page and how far it was executed, kept in the browser (IndexedDB), so that a reload does not lose it.
 * Text and place are two records: the place is written while the job runs. Two tabs share them: a job that runs takes
 * them back from one that was only loaded.
 */
import { t } from "../words";
import type { Began } from "./began";

export interface KeptJob {
  /** Of this loading of the file. */
  id: string;
  name: string;
  source: string;
}

export interface KeptPlace {
  id: string;
  /** In the file, of a resume; 0: nothing was sent. */
  line: number;
  state: string;
  why: string;
  /** What it was sent to. */
  machine: string;
  /** Which start of it, if it says so; left out by earlier versions of the page. */
  start?: string;
  /** In what it ran; left out by earlier versions of the page. */
  began?: Began;
}

const DATABASE = "wificnc";
const STORE = "job";

let database: Promise<IDBDatabase> | null = null;

function opened(): Promise<IDBDatabase> {
  database ??= new Promise((resolve, reject) => {
    const asked = indexedDB.open(DATABASE, 1);
    asked.onupgradeneeded = () => asked.result.createObjectStore(STORE);
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = asked.onblocked = () => reject(asked.error ?? new Error(t`the database is blocked`));
  });
  return database;
}

function inWords(error: DOMException | null): Error {
  return error && error.name !== "QuotaExceededError" ? error : new Error(t`the browser's storage is full`);
}

/** Rejects when the browser does not keep it. */
async function transact(work: (store: IDBObjectStore) => void, mode: IDBTransactionMode = "readwrite"): Promise<void> {
  const transaction = (await opened()).transaction(STORE, mode);
  const done = new Promise<void>((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onerror = transaction.onabort = () => reject(inWords(transaction.error));
  });
  work(transaction.objectStore(STORE));
  return done;
}

export function keepJob(job: KeptJob, place: KeptPlace): Promise<void> {
  return transact((store) => {
    store.put(job, "text");
    store.put(place, "place");
  });
}

/** @param job  its text, written again where another tab has put its own; null: this one gives way
 * @returns whether the job is kept: the place of a text that is not kept is not written */
export async function keepPlace(place: KeptPlace, job: KeptJob | null): Promise<boolean> {
  let isKeptHere = true;
  await transact((store) => {
    const asked = store.get("place");
    asked.onsuccess = () => {
      const isOwn = (asked.result as KeptPlace | undefined)?.id === place.id;
      isKeptHere = isOwn || job !== null;
      if (!isOwn && !job) return;
      if (!isOwn) store.put(job, "text");
      store.put(place, "place");
    };
  });
  return isKeptHere;
}

/** What was kept cannot be brought back. */
export class DamagedError extends Error {}

const isText = (value: unknown): boolean => typeof value === "string";

/** Whether these are records that can be brought back: another version of the page may have written them. */
export function isKept(job: unknown, place: unknown): boolean {
  const [text, at] = [job as KeptJob | null | undefined, place as KeptPlace | null | undefined];
  const isJob = isText(text?.id) && isText(text?.name) && isText(text?.source);
  return isJob && isText(at?.id) && isText(at?.state) && isText(at?.why) && isText(at?.machine) && Number.isInteger(at?.line);
}

/** null: nothing is kept. Rejects with a DamagedError, in words for people, or when the browser does not keep it. */
export async function readKept(): Promise<{ job: KeptJob; place: KeptPlace } | null> {
  let [job, place]: [unknown, unknown] = [undefined, undefined];
  await transact((store) => {
    const [text, at] = [store.get("text"), store.get("place")];
    text.onsuccess = () => (job = text.result);
    at.onsuccess = () => (place = at.result);
  }, "readonly");
  if (job === undefined || place === undefined) return null;
  if (!isKept(job, place)) throw new DamagedError(t`The job that this browser had kept is damaged and was discarded`);
  const kept = { job: job as KeptJob, place: place as KeptPlace };
  return kept.job.id === kept.place.id ? kept : null;
}

/** Whatever it is. */
export function forgetDamaged(): Promise<void> {
  return transact((store) => void store.clear());
}

/** Unless another tab's job is there by now. */
export function forgetKept(id: string): Promise<void> {
  return transact((store) => {
    const asked = store.get("place");
    asked.onsuccess = () => {
      if ((asked.result as KeptPlace | undefined)?.id === id) store.clear();
    };
  });
}
