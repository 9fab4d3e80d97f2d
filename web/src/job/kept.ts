/**
 * The job of this page and how far it was executed, kept in the browser (IndexedDB), so that a reload does not lose it.
 * Text and place are two records: the place is written while the job runs. Two tabs share them: a job that runs takes
 * them back from one that was only loaded.
 */
import { t } from "../words";

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

/** Rejects when the browser does not keep it. */
async function transact(work: (store: IDBObjectStore) => void, mode: IDBTransactionMode = "readwrite"): Promise<void> {
  const transaction = (await opened()).transaction(STORE, mode);
  const done = new Promise<void>((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onerror = transaction.onabort = () => reject(transaction.error ?? new Error(t`the browser's storage is full`));
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

/** @param job  its text, written again where another tab has put its own; null: this one gives way */
export function keepPlace(place: KeptPlace, job: KeptJob | null): Promise<void> {
  return transact((store) => {
    const asked = store.get("place");
    asked.onsuccess = () => {
      const isOwn = (asked.result as KeptPlace | undefined)?.id === place.id;
      if (!isOwn && !job) return;
      if (!isOwn) store.put(job, "text");
      store.put(place, "place");
    };
  });
}

/** null: nothing is kept. */
export async function readKept(): Promise<{ job: KeptJob; place: KeptPlace } | null> {
  let [job, place]: [KeptJob | undefined, KeptPlace | undefined] = [undefined, undefined];
  await transact((store) => {
    const [text, at] = [store.get("text"), store.get("place")];
    text.onsuccess = () => (job = text.result as KeptJob | undefined);
    at.onsuccess = () => (place = at.result as KeptPlace | undefined);
  }, "readonly");
  return job && place && (job as KeptJob).id === (place as KeptPlace).id ? { job, place } : null;
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
