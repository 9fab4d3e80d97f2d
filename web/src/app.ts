/** What the page has one of: the controller and its job. */
import { computed, effect, signal } from "@preact/signals";
import { JobRunner } from "./job/runner";
import { PreflightRunner } from "./job/preflight";
import { hasArrived } from "./link/arrival";
import { askWhoServes, connectFirst } from "./link/served";
import { Controller } from "./link/controller";
import { pickPort, SerialTransport } from "./link/serial";
import { ownAddress, SocketTransport } from "./link/socket";
import { LinkError } from "./link/transport";
import { NOWHERE, standsAlike, type Standing } from "./job/standing";
import { settingNumber } from "./tables";
import { t } from "./words";

const THEME_KEY = "wificnc.theme";
const KNOWN_KEY = "wificnc.known";
const HELD = new Set(["Hold", "Tool", "Door"]);

export const controller = new Controller();
export const job = new JobRunner(controller);
controller.mayAsk = () => !job.active.peek();
controller.memory = { load: () => stored(KNOWN_KEY), save: (text) => store(KNOWN_KEY, text) };
export const preflight = new PreflightRunner();

/** What this page is doing with lines of its own, in words, such as a macro; "": nothing. */
export const doing = signal("");

/** Why no line may be sent now; "": one may. Hold, Resume, Reset and the overrides are bytes, and always go. */
export const noLines = computed(() => {
  if (!controller.connected.value) return t`Connect to a controller first.`;
  if (controller.locked.value) return t`This controller is locked: log in with its access key.`;
  if (!controller.commands.value) return t`Another client is in control of this controller.`;
  if (controller.mpg.value) return t`The pendant is in control (MPG): return control there.`;
  if (doing.value) return doing.value;
  if (controller.operates.value) return "";
  if (job.active.value) return t`A job is running: stop it, or wait until it is finished.`;
  return held.value;
});
/** Where the rest of a job may wait in the machine, also of one that this page had before it was loaded again; "": nowhere. */
export const held = computed(() => (controller.connected.value && HELD.has(controller.state.value) ? t`The machine is in a hold: press Resume, or Reset to discard the rest.` : ""));
/** Why nothing may move to a place that was set before; "": it may. */
export const noPlace = computed(() => (controller.positionLost.value ? t`The position is lost: home the machine or set a new zero first.` : ""));
/** The same of what needs a machine at rest: also one in an alarm, and an idle one only. */
export const noHoming = computed(() => noLines.value || unlessIn("Idle", "Alarm"));
export const noMotion = computed(() => noLines.value || (controller.operates.value ? unlessAtRest() : unlessIn("Idle")));

function unlessAtRest(): string {
  return controller.status.value?.substate !== 1 ? "" : t`The machine is moving: wait until it rests.`;
}

function unlessIn(...states: string[]): string {
  const state = controller.state.value;
  if (states.includes(state)) return "";
  if (controller.operates.value) return t`A job waits in this hold: press Resume and let it finish, or Reset to discard it.`;
  return state === "Alarm" ? t`The machine is locked: unlock or home it first.` : t`The machine is busy: wait until it is idle.`;
}

const MM_PER_INCH = 25.4;
const REPORTS_IN_INCHES = settingNumber("report_inches");

let shownAxes = 3;
/** Axes whose rows and buttons are shown: those of the last machine stay while the next one has not reported, and nothing moves. */
export const axesShown = computed(() => (shownAxes = controller.axisCount.value || shownAxes));

/** The state of the connected machine before a job, once it has said all of it. */
export const standing = computed<Standing>(() => {
  const [settings, machine] = [controller.settings.value, controller.machinePosition.value];
  if (!controller.connected.value || settings.size === 0 || machine.length === 0 || !controller.offsets.value.has("G54")) return NOWHERE;
  const unit_mm = Number(settings.get(REPORTS_IN_INCHES) ?? 0) ? MM_PER_INCH : 1;
  const inMm = (values: readonly number[]): number[] => values.map((value, i) => (i < 3 ? value * unit_mm : value));
  const rows = [...controller.offsets.value].map(([name, body]) => [name, body.split(",").map(Number)] as const);
  return {
    settings,
    machine_mm: inMm(machine),
    offsets: new Map(rows.filter(([, numbers]) => numbers.every(Number.isFinite)).map(([name, numbers]) => [name, inMm(numbers)])),
    origin_mm: inMm(controller.wco.value),
    modes: controller.modes.value,
    homed: controller.homed.value,
  };
});

/** Why the connected machine has not said all of it yet, and when it will; "": it has, or none is connected. */
export const unknownYet = computed(() => {
  if (!controller.connected.value || standing.value !== NOWHERE) return "";
  if (controller.locked.value) return t`The controller reports its settings and offsets after the login.`;
  if (!controller.commands.value) return t`The controller reports its settings and offsets to this page when it takes control.`;
  const { state } = controller;
  if (["", "Idle", "Alarm"].includes(state.value)) return t`The controller is reporting its settings and offsets.`;
  if (HELD.has(state.value)) return t`The controller reports its settings and offsets when this pause has ended. State and position are known.`;
  return t`The controller reports its settings and offsets when the machine is idle. State and position are known.`;
});

/** Send a line, and wait until the machine rests. Rejects when a jog was stopped before its end, by this page or anyone else: the next
 * line would move from where that has left the machine. @param stops  of the controller, at the start of all lines */
export async function move(line: string, stops = controller.stops): Promise<void> {
  const before = standing.peek();
  await controller.send(line);
  await controller.rest();
  if (controller.stops !== stops) throw new Error(t`Stopped by hand.`);
  if (!hasArrived(line, before, standing.peek())) throw new Error(t`A move was stopped before its end, so nothing follows it.`);
}

const SETTLED_MS = 300;
/** The job is to be checked when the connected machine is known: not by defaults meanwhile. */
const checkWaits = signal(false);

/** Run the job on the core, as the connected machine would; without one, on the chosen board's defaults. */
export async function checkJob(): Promise<void> {
  checkWaits.value = unknownYet.peek() !== "";
  if (checkWaits.peek()) return;
  preflight.progress.value = 0;
  const { board, HOST } = await import("./chosen").catch((error: unknown) => {
    preflight.progress.value = null;
    throw error;
  });
  const program = job.program.value;
  if (program) await preflight.check(program, standing.value === NOWHERE ? board.value : HOST, standing.value);
}

/** Another work zero, another setting, a machine that is not known yet: another job. A lost machine is not another one. */
export const isStale = computed(() => {
  const done = preflight.result.value;
  if (done === null || job.active.value || controller.link.value === "lost") return false;
  return unknownYet.value !== "" || !standsAlike(standing.value, done.standing);
});

effect(() => {
  if (unknownYet.value || !(isStale.value || checkWaits.value)) return undefined;
  const timer = setTimeout(() => void attempt(checkJob), SETTLED_MS);
  return () => clearTimeout(timer);
});

export type Theme = "light" | "dark";

/** Of `GET api/controller`, when a controller serves this page. */
export interface Served {
  name: string;
  version: string;
  board: string;
  axes: number;
}

export const served = signal<Served | null>(null);
export const theme = signal<Theme>(storedTheme());
/** The port that the page has, for the console and for installing. */
export const port = signal<SerialPort | null>(null);
/** What went wrong last, for the notice under the header. */
export const failure = signal<{ title: string; hint: string } | null>(null);

effect(() => {
  document.documentElement.dataset.theme = theme.value;
});

export function toggleTheme(): void {
  theme.value = theme.value === "dark" ? "light" : "dark";
  store(THEME_KEY, theme.value);
}

/** Show what went wrong, in words and with what to do. */
export function fail(error: unknown): void {
  const hint = error instanceof Error && "hint" in error ? String(error.hint) : "";
  failure.value = { title: error instanceof Error ? error.message : String(error), hint };
}

/** Do it, and show what goes wrong. */
export async function attempt(work: () => Promise<unknown>): Promise<void> {
  failure.value = null;
  try {
    await work();
  } catch (error) {
    fail(error);
  }
}

export async function connectSerial(): Promise<void> {
  const picked = await thePort();
  if (picked) await controller.connect(new SerialTransport(picked));
}

/** The port that was picked, unless it was unplugged since; else the user picks one. null: changed their mind. */
async function thePort(): Promise<SerialPort | null> {
  if (port.value) return port.value;
  const picked = await pickPort();
  picked?.addEventListener("disconnect", () => {
    if (port.value === picked) port.value = null;
  });
  port.value = picked;
  return picked;
}

export async function connectSocket(): Promise<void> {
  await controller.connect(new SocketTransport(ownAddress()));
}

/** The link that was lost, once more. */
export async function connectAgain(): Promise<void> {
  await (controller.isSerial ? connectSerial() : connectSocket());
}

/** Whether a lost link is tried again by itself. */
export const reconnects = signal(false);
/** What was missed: for how long, and what became of the job that was being sent. */
export const reconnected = signal<{ lost_s: number; job: string } | null>(null);

const TRY_AGAIN_MS = [500, 1000, 2000, 4000];

effect(() => {
  if (controller.link.value === "lost" && !reconnects.peek()) queueMicrotask(() => void tryAgain());
});

/** A link that opens shows the controller's state again; nothing is sent and nothing continues by itself. */
async function tryAgain(): Promise<void> {
  const lostAt = Date.now();
  const job_ended = job.state.peek() === "lost" ? job.why.peek() : "";
  reconnects.value = true;
  reconnected.value = null;
  for (let n = 0; reconnects.peek() && controller.link.peek() === "lost"; n++) {
    await new Promise((resolve) => setTimeout(resolve, TRY_AGAIN_MS[Math.min(n, TRY_AGAIN_MS.length - 1)]));
    if (!reconnects.peek() || controller.link.peek() !== "lost") break;
    await reopen().catch(() => {});
  }
  reconnects.value = false;
  if (controller.link.peek() === "open") reconnected.value = { lost_s: Math.round((Date.now() - lostAt) / 1000), job: job_ended };
}

/** Without a question to the user: a serial port that was allowed before, or the address of this page. */
async function reopen(): Promise<void> {
  if (!controller.isSerial) return connectSocket();
  const ports = await navigator.serial.getPorts();
  const allowed = port.value ?? (ports.length === 1 ? ports[0]! : null); // of several it could be another machine's
  if (!allowed) return undefined;
  port.value = allowed;
  return controller.connect(new SerialTransport(allowed));
}

/** A port for the loader: the console lets go of it first. Rejects with a LinkError; null: no one picked one. */
export async function portForLoader(): Promise<SerialPort | null> {
  await controller.disconnect();
  return thePort();
}

/** The key that the link of a QR code has brought (`wificnc wifi status`), until it is used: once. */
let linkKey = "";

/** Before anyone can look over a shoulder, or store the address as a bookmark. A fragment is not sent to servers. */
function takeLinkKey(): void {
  linkKey = new URLSearchParams(location.hash.slice(1)).get("key") ?? "";
  if (linkKey) history.replaceState(null, "", location.pathname + location.search);
}

effect(() => {
  const key = controller.locked.value ? linkKey : "";
  if (!key) return;
  linkKey = "";
  queueMicrotask(() => void attempt(() => logIn(key))); // behind the message that it is locked
});

/** Rejects with a LinkError. */
export async function logIn(key: string): Promise<void> {
  if (!(await controller.login(key)))
    throw new LinkError(t`This access key is not accepted`, t`It is shown over USB. Case, dashes and spaces do not matter.`);
  controller.locked.value = false;
  await controller.getToKnow();
}

/** When a controller serves this page, connect to it. */
export async function start(): Promise<void> {
  takeLinkKey();
  const wait = (ms: number): Promise<void> => new Promise((resolve) => setTimeout(resolve, ms));
  const answer = await askWhoServes(() => fetch(new URL("./api/controller", document.baseURI)), wait);
  if (!answer?.ok || !answer.headers.get("content-type")?.includes("json")) return;
  served.value = (await answer.json()) as Served;
  // A user may have been faster, by USB.
  await connectFirst(() => attempt(connectSocket), () => controller.link.peek() === "closed", wait);
}

function storedTheme(): Theme {
  const kept = stored(THEME_KEY);
  if (kept === "light" || kept === "dark") return kept;
  return window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

/** A browser may forbid storage: then nothing is remembered. */
export function stored(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

export function store(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // nothing is remembered
  }
}
