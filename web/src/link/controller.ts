/**
 * One controller and what is known of it. Everything that the page shows of the machine is a signal here; everything
 * that it says to the machine goes through send() or realtime().
 */
import { batch, computed, effect, signal } from "@preact/signals";
import { AXES, TABLES, alarmWords, errorWords, settingsOf, type RealtimeName } from "../tables";
import { keyWords } from "./keys";
import { checkLine } from "./line";
import { LineSplitter, parse, receiveBuffer, type Message, type Status } from "./messages";
import { LineQueue, SMALLEST_BUFFER, type Answer } from "./queue";
import { changedBy, isQuestion, QUESTIONS, type Question } from "./questions";
import { LinkError, type Transport } from "./transport";
import { msg, t } from "../words";

export type LinkState = "closed" | "opening" | "open" | "lost";
/** Whose lines the controller takes. */
export type Role = "owner" | "observer" | "nobody";

/** Taken: by another client. Restarted: switched off, or by itself, so its position is lost. */
export type Break = "reset" | "lost" | "closed" | "taken" | "restarted";

export interface Memory {
  load(): string | null;
  save(text: string): void;
}

/** Of one start of a controller: the lines that answered each question. */
interface Known {
  start: string;
  said: Partial<Record<Question, string[]>>;
  /** The position was lost with this start, and was not found since. */
  isLost?: boolean;
}

export interface LogEntry {
  id: number;
  from: "me" | "controller" | "page";
  text: string;
  bad: boolean;
}

/** How often a report is asked for, ms: while it moves, at rest; and how long an answer may take. */
const ASK_MOVING_MS = 100;
const ASK_RESTING_MS = 250;
const SILENT_MS = 3000;
/** A network link on which nothing comes for this time is given up: a new one is opened. */
const DEAD_MS = 5000;
/** Reset that is pressed again before its answer may be answered again, within this time. */
const OWN_RESET_MS = 3000;
const LOG_LINES = 500;
/** A board that starts when its port is opened says something within this time. */
const FIRST_WORD_MS = 6000;

const HELD = new Set(["Hold", "Tool", "Door"]);
const TAKES_HANDS = new Set(["Hold", "Tool"]); // the second one has no substate: it moves as Hold:1
const MOVING = new Set(["Run", "Jog", "Home"]);
/** States in which Grbl answers every question. */
const ANSWERS_IN = new Set(["Idle", "Alarm"]);
const STOPS: ReadonlySet<RealtimeName> = new Set(["HOLD", "RESET", "JOG_CANCEL"]);
/** Also over a link that may be dead: questions, and what ends a jog whose lines are on their way. */
const GOES_ALWAYS: ReadonlySet<RealtimeName> = new Set(["STATUS", "FULL_STATUS", "JOG_CANCEL"]);
const OBSERVER = /^Observer: | is in control$/;
const OBSERVED = /^Observer: (.+) is in control/;
const IN_CONTROL = /^In control$/;
const NOBODY = /^No client is in control/;
const LOCKED = /^(Locked: log in|Wrong access key)/;
/** Answers to lines that the controller has not looked at: not logged in, an observer. */
const NOT_TAKEN = new Set([180, 181]);
/** After some alarms the controller takes no commands until it is reset. */
const TOOL_CHANGE = /^Tool change: T(\d+)/;
const PARKED = /^Parked:/;
/** Lines are the job's again, or still: the job cannot be left here, or cannot be resumed with what was set. */
const NOT_PARKED = /^Not (?:parked|resumed): (.+)$/;
/** M6 with $341=3: the tool change continues to wait. */
const NOT_MEASURED = /^Tool not measured: /;
const MEASURED = /^Tool length: /;
const NEEDS_RESET = /^Reset to continue/;
/** Why the controller itself keeps the machine stopped (core/machine/reset.c), also within "Locked by ALARM:57: …". */
const SELF_LOCKS: readonly [RegExp, string][] = [
  [/a firmware update is being written/i, msg`A firmware update is being written: wait until it ends`],
  [/safe mode after crashes/i, msg`Safe mode after crashes in a row: switch the controller off and on`],
  [/step pulses were lost/i, msg`Step pulses were lost: restart the controller`],
];
/** Reported at rest to all who are connected. */
const JOG_STOPPED = /^Another client or a button stopped the jog/;
const DRIVER_SAYS = /^Driver [XYZABC2 ]+: /;
/** Rows of `$#`. */
const OFFSET = /^(G\d[\d.]*|TLO|PRB)$/;

const HOMING_CYCLES = TABLES.settings.filter((row) => /^homing_cycle_/.test(row.name)).map((row) => row.number);
/** Another scale or another zero; motors without power. */
const FORGETS_HOME = /^\$(?:RST|SLP|X)/i;
const MOVES_ZERO = new Set(
  settingsOf(AXES.length)
    .filter(({ row }) => row.affects.includes("position") || row.affects.includes("homing"))
    .map((setting) => setting.number),
);

/** A line was refused, or no one will answer it. */
export class RefusedError extends Error {
  constructor(
    readonly line: string,
    readonly code: number | null,
  ) {
    super(code === null ? t`${line}: the controller was reset or is gone` : t`${line}: error ${code}, ${errorWords(code)}`);
  }
}

export class Controller {
  readonly link = signal<LinkState>("closed");
  readonly linkName = signal("");
  /** Why the link was lost. */
  readonly lostWhy = signal("");
  readonly role = signal<Role>("nobody");
  readonly locked = signal(false);
  /** Who is in control, while this page only views; "": not known. */
  readonly takenBy = signal("");
  /** No report came for a while. */
  readonly silent = signal(false);
  /** Names of the keys that were pressed meanwhile, and were not sent. */
  readonly dropped = signal<readonly RealtimeName[]>([]);
  /** Another one after each start of the controller; "": it does not say. */
  readonly startId = signal("");
  /** The controller was switched off or restarted since this page knew its position, and it was not homed since, nor a zero set. */
  readonly positionLost = signal(false);
  readonly status = signal<Status | null>(null);
  readonly wco = signal<number[]>([]);
  readonly overrides = signal<[number, number, number]>([100, 100, 100]);
  readonly accessories = signal("");
  /** A pendant has control: lines of others are refused. */
  readonly mpg = signal(false);
  /** The last message about a motor driver; "": none since the controller has started. */
  readonly driverSays = signal("");
  readonly alarm = signal<number | null>(null);
  readonly needsReset = signal(false);
  /** Why the controller keeps the machine stopped, for reading; "": it does not. */
  readonly selfLock = signal("");
  /** The program waits for this tool (M6); null: for none. */
  readonly awaitedTool = signal<number | null>(null);
  /** Lines are the operator's (0xA3 in a hold), until `~` returns to the job. */
  readonly parked = signal(false);
  /** Why it did not park, or did not return, the last time; "": it did. */
  readonly notParked = signal("");
  /** That the tool of this change could not be measured, and why, as the controller says it; "": it was, or is not yet. */
  readonly notMeasured = signal("");
  /** It has started again, and not because this page has reset it. */
  readonly restarted = signal(false);
  /** A homing line is under way: Grbl gives no reports then, WiFiCNC only those of 0x87. */
  readonly homing = signal(false);
  /** Axes that this page has seen homed, and nothing since that could have moved them unseen. */
  readonly homed = signal("");
  readonly settings = signal<ReadonlyMap<number, string>>(new Map());
  readonly offsets = signal<ReadonlyMap<string, string>>(new Map());
  readonly modes = signal("");
  readonly version = signal("");
  readonly options = signal("");
  readonly log = signal<readonly LogEntry[]>([]);

  readonly connected = computed(() => this.link.value === "open");
  readonly commands = computed(() => this.connected.value && this.role.value !== "observer" && !this.locked.value);
  /** As a report says it, or as it must be when there are none. */
  readonly state = computed(() => {
    if (this.alarm.value !== null) return "Alarm";
    return this.homing.value ? "Home" : (this.status.value?.state ?? "");
  });
  /** A parked hold takes lines: the operator may jog, probe and set offsets. */
  readonly operates = computed(() => this.parked.value && TAKES_HANDS.has(this.state.value));
  readonly axisCount = computed(() => this.machinePosition.value.length);
  readonly machinePosition = computed(() => {
    const status = this.status.value;
    if (status?.mpos) return status.mpos;
    return (status?.wpos ?? []).map((value, i) => value + (this.wco.value[i] ?? 0));
  });
  readonly workPosition = computed(() => {
    const status = this.status.value;
    return status?.wpos ?? (status?.mpos ?? []).map((value, i) => value - (this.wco.value[i] ?? 0));
  });

  /** Called when lines may go again: whoever streams a job puts the next ones. */
  onRoom: () => void = () => {};
  /** Every report, and every alarm, in the order in which they came: signals show the last one of a burst. */
  onReport: (status: Status) => void = () => {};
  onAlarm: (code: number) => void = () => {};
  onMessage: (text: string) => void = () => {};
  /** A jog was ended by someone else than its owner. */
  onJogStopped: () => void = () => {};
  /** The controller has started again, or the connection was closed: what was under way is void. */
  onBreak: (what: Break) => void = () => {};

  /** What was answered to questions is kept here over a reload, for a hold and an observer, whose questions are not read. */
  memory: Memory = { load: () => null, save: () => {} };

  /** Whether the page may put questions of its own: not between the lines of a job. */
  mayAsk: () => boolean = () => true;

  /** The link now, or the last one. */
  isSerial = false;

  /** Presses of this page that stop the machine, sent or dropped: what moves it in more than one line ends with each. */
  stops = 0;
  /** Jogs, and probing in a parked hold, that anyone else has stopped. */
  othersStops = 0;
  /** Resets that were reported, by anyone: what waits for the end of a hold does not follow one. */
  resets = 0;

  readonly queue = new LineQueue();
  private transport: Transport | null = null;
  private splitter = new LineSplitter();
  private timer: ReturnType<typeof setInterval> | undefined;
  private askedAt = 0;
  private heardAt = 0;
  private waitsForReport = false;
  /** ... since: a tab in the background asks once a minute, and its link is alive. */
  private waitsSince = 0;
  /** Reports that came, and those that were asked for since the last one. */
  private heard = 0;
  private unheard = 0;
  private entries = 0;
  private resetAsked = false;
  private resetsMore: number[] = [];
  /** What is not known, or may have changed; and the state in which the controller did not say it. */
  private readonly unknown = new Set<Question>();
  private refusedIn = "";
  private asking = false;
  private reportAsked = false;
  /** The next report is to have all fields: which start of the controller it is. */
  private asksStart = true;
  private firstWord: (() => void) | null = null;

  /** Open a link and get to know the controller. Rejects with a LinkError. */
  async connect(transport: Transport): Promise<void> {
    await this.disconnect();
    const [before, why] = [this.link.value, this.lostWhy.value];
    this.begin(transport);
    const firstWord = this.hearFirstWord();
    try {
      await transport.open({ bytes: (data) => this.hear(data), lost: (reason) => this.lose(reason) });
    } catch (error) {
      this.lostWhy.value = why;
      this.link.value = before === "lost" ? "lost" : "closed";
      throw error;
    }
    this.transport = transport;
    this.link.value = "open";
    this.timer = setInterval(() => this.tick(), ASK_MOVING_MS / 2);
    if (!(await firstWord)) {
      await this.disconnect();
      throw new LinkError(
        t`The port is open, but no controller answers`,
        t`Check that WiFiCNC is installed on this board (Install tab), or try another port.`,
      );
    }
    await this.catchUp();
  }

  async disconnect(): Promise<void> {
    const transport = this.transport;
    clearInterval(this.timer);
    this.transport = null;
    if (transport) {
      this.link.value = "closed";
      this.queue.forget();
      this.onBreak("closed");
      await transport.close();
    }
  }

  /** A line, without its end. Resolves with the lines before its ok; rejects with a RefusedError. */
  async send(text: string): Promise<string[]> {
    const answer = await this.post(text);
    if (answer.kind === "ok") return answer.said;
    throw new RefusedError(text, answer.kind === "error" ? answer.code : null);
  }

  /** As send(), for whoever looks at the answer itself. Rejects with a LineError: nothing was sent. */
  async post(text: string, echo = true): Promise<Answer> {
    checkLine(text);
    if (echo) this.note("me", text);
    const homes = text.startsWith("$H");
    if (homes) this.homing.value = true;
    if (forgetsHome(text)) this.homed.value = "";
    const answer = await this.ask(text, false);
    this.learn(text, answer);
    if (homes) this.homing.value = false;
    if (!homes || answer.kind !== "ok") return answer;
    if (text === "$H") this.findPosition();
    if (text === "$H" && this.unknown.has("$$")) await this.refresh("$$"); // which has the cycles
    this.homed.value += this.homesAxes(text);
    return answer;
  }

  /** The key itself is never sent: who listens to the network learns nothing of use. */
  async login(key: string): Promise<boolean> {
    const { loginProof } = await import("./login"); // its hashes are of no use without a key
    const asked = await this.ask("$LOGIN", true);
    if (asked.kind !== "ok") return false;
    const proof = loginProof(key, asked.said);
    return proof === null || (await this.ask(`$LOGIN=${proof}`, true)).kind === "ok";
  }

  /** The machine has come to rest: two reports in a row from one place. Rejects when it is held, locked or gone, and when a
   * parked hold ends, whose job moves it. */
  rest(): Promise<void> {
    return new Promise((resolve, reject) => {
      const asked = this.status.peek();
      const isParked = this.operates.peek();
      let place = "";
      const stop = effect(() => {
        const [status, link] = [this.status.value, this.link.value];
        const end = (how: () => void): void => queueMicrotask(() => (stop(), how()));
        if (link !== "open") return end(() => reject(new Error(t`The connection was lost while the machine was moving`)));
        if (isParked && !this.operates.value) return end(() => reject(new Error(t`The job was resumed at the machine or by another client, so nothing follows.`)));
        if (status === asked || status === null || MOVING.has(status.state)) return undefined;
        if (this.operates.value && status.substate === 1) return undefined;
        if (status.state !== "Idle" && !this.operates.value) return end(() => reject(new Error(t`The machine did not stop: ${status.state}`)));
        if (!this.queue.idle) return undefined; // a line that is on its way may move it
        const now = String(status.mpos ?? status.wpos);
        if (now === place) return end(resolve);
        place = now;
        return undefined;
      });
    });
  }

  /** Ask again now, and leave it out of the terminal: the signals have the answer when this resolves. */
  async refresh(...questions: readonly Question[]): Promise<void> {
    for (const question of questions) this.learn(question, await this.ask(question, true));
  }

  /** refresh(), unless what is known of it is so already. */
  async known(question: Question): Promise<void> {
    if (this.unknown.has(question) || !this.queue.idle) await this.refresh(question);
  }

  /** Ask for what only one card shows, and leave it out of the terminal. null: refused, or lines of others are under way. */
  async query(question: "$DRIVERS" | "$SPINDLES" | "$#"): Promise<readonly string[] | null> {
    const isOpen = this.operates.peek() && question === "$#";
    if (!this.commands.peek() || !this.queue.idle || !(isOpen || this.mayAsk())) return null;
    if (HELD.has(this.state.peek()) && !isOpen) return null; // lines wait until it is over
    if (question === "$SPINDLES" && !ANSWERS_IN.has(this.state.peek())) return null;
    const answer = await this.ask(question, true);
    return answer.kind === "ok" ? answer.said : null;
  }

  private ask(text: string, quiet: boolean): Promise<Answer> {
    if (this.isDead || !this.transport) return Promise.resolve({ kind: "lost" });
    return new Promise((resolve) => {
      this.queue.put({ text, quiet, settle: resolve });
      this.flush();
    });
  }

  /** `$HXZ`: these; `$H`: those of its cycles. */
  private homesAxes(line: string): string {
    if (line.length > 2) return line.slice(2).toUpperCase();
    const cycles = HOMING_CYCLES.map((n) => Number(this.settings.value.get(n) ?? 0));
    const mask = cycles.reduce((all, cycle) => all | cycle, 0);
    return [...AXES].filter((_, i) => (mask >> i) & 1).join("");
  }

  /** A byte that acts immediately, by its name. */
  realtime(name: RealtimeName): void {
    if (STOPS.has(name)) {
      this.stops++;
      this.queue.callOffJogs();
    }
    if (this.isDead && !GOES_ALWAYS.has(name)) return this.drop(name);
    if (this.dropped.peek().includes(name)) this.dropped.value = this.dropped.peek().filter((each) => each !== name);
    if (name === "RESUME" || name === "PARK") this.notParked.value = "";
    if (name === "RESUME") this.unpark();
    if (name === "STATUS") this.unheard++;
    this.write(Uint8Array.of(TABLES.realtime[name]));
  }

  /** What is sent now would arrive when no one expects it any more. */
  private get isDead(): boolean {
    return this.silent.peek() && !this.isSerial;
  }

  private drop(name: RealtimeName): void {
    if (!this.dropped.peek().includes(name)) this.dropped.value = [...this.dropped.peek(), name];
    this.note("page", t`Not sent, because the controller does not answer: ${keyWords(name)}`, true);
  }

  reset(): void {
    if (this.resetAsked) this.resetsMore.push(performance.now());
    this.resetAsked = !this.isDead;
    this.realtime("RESET");
  }

  /** A jog and the operator's probing end where they are; a move of an idle machine is held, and discarded at rest.
   * @param isParked  what is to stop began in a parked hold @returns whether it was sent: to a link that is dead nothing is */
  stopMotion(isParked = this.operates.peek()): boolean {
    this.realtime("JOG_CANCEL");
    return isParked ? !this.isDead : this.resetAtRest(() => HELD.has(this.status.peek()?.state ?? ""));
  }

  /** Hold, and reset when nothing moves: so the position is kept. A report that was asked for before the hold may be
   * from before the motion. @param isWanted  asked at rest @returns whether it was sent */
  resetAtRest(isWanted: () => boolean): boolean {
    this.realtime("HOLD");
    if (this.isDead) return false;
    const before = this.heard + this.unheard;
    const end = effect(() => {
      const [status, link] = [this.status.value, this.link.value];
      if (link === "open" && (status === null || this.heard <= before || moves(status))) return;
      queueMicrotask(() => end());
      if (link === "open" && isWanted()) this.reset();
    });
    return true;
  }

  private unpark(): void {
    this.parked.value = false;
    this.queue.unpark();
  }

  /** Read all settings, offsets and modes again. */
  async getToKnow(): Promise<void> {
    this.doubt(QUESTIONS);
    await this.catchUp();
  }

  /** The terminal shows the next report. */
  askForReport(): void {
    this.reportAsked = true;
    this.realtime("STATUS");
  }

  private doubt(questions: readonly Question[]): void {
    for (const question of questions) this.unknown.add(question);
    if (questions.length > 0) this.refusedIn = "";
  }

  /** Ask what is not known: of a machine at rest, and when no one else's lines are under way. */
  private async catchUp(): Promise<void> {
    if (this.asking) return;
    this.asking = true;
    for (const question of QUESTIONS) {
      if (!this.unknown.has(question) || !this.mayAskNow()) continue;
      this.learn(question, await this.ask(question, true));
    }
    this.asking = false;
  }

  private mayAskNow(): boolean {
    const state = this.state.peek();
    if (!this.commands.peek() || this.needsReset.peek() || state === this.refusedIn || !this.queue.idle) return false;
    return this.operates.peek() ? this.status.peek()?.substate !== 1 : ANSWERS_IN.has(state) && this.mayAsk();
  }

  private learn(text: string, answer: Answer): void {
    if (!isQuestion(text)) {
      this.doubt(changedBy(text));
      return;
    }
    if (answer.kind === "ok") {
      this.unknown.delete(text);
      if (text === "$$") this.settings.value = settingsIn(answer.said);
      this.remember(text, answer.said);
    } else if (answer.kind === "error") this.refusedIn = this.state.peek();
  }

  private remember(question: Question, said: string[]): void {
    this.keep({ said: { ...this.remembered()?.said, [question]: said } });
  }

  private keep(part: Partial<Known>): void {
    const start = this.startId.peek();
    if (start) this.memory.save(JSON.stringify({ said: {}, ...this.remembered(), ...part, start } satisfies Known));
  }

  /** null: of another start, of none, or damaged. */
  private remembered(): Known | null {
    try {
      const known = JSON.parse(this.memory.load() ?? "null") as Known | null;
      return known && known.start === this.startId.peek() && typeof known.said === "object" ? known : null;
    } catch {
      return null;
    }
  }

  /** Until the controller answers: it is asked again as soon as it reads lines. */
  private recall(): void {
    const { said = {}, isLost = false } = this.remembered() ?? {};
    if (isLost) this.positionLost.value = true;
    for (const question of QUESTIONS) {
      const lines = said[question];
      if (!this.unknown.has(question) || !Array.isArray(lines)) continue;
      if (question === "$$" && this.settings.peek().size === 0) this.settings.value = settingsIn(lines);
      for (const message of lines.map(parse))
        if (message.kind === "bracket" && message.key !== "MSG" && message.key !== "START") this.takeBracket(message.key, message.body);
    }
  }

  note(from: LogEntry["from"], text: string, bad = false): void {
    this.log.value = [...this.log.value.slice(1 - LOG_LINES), { id: ++this.entries, from, text, bad }];
  }

  /** Send what there is room for. */
  flush(): void {
    const data = this.queue.take();
    if (data) this.write(new TextEncoder().encode(data));
  }

  private begin(transport: Transport): void {
    if (this.linkName.peek() && this.linkName.peek() !== transport.name) this.startId.value = ""; // another machine
    batch(() => {
      this.link.value = "opening";
      this.linkName.value = transport.name;
      this.lostWhy.value = "";
      this.role.value = "nobody";
      this.mpg.value = false;
      this.locked.value = this.silent.value = this.needsReset.value = this.homing.value = false;
      this.status.value = this.alarm.value = null;
      this.endToolChange();
      this.selfLock.value = "";
      this.settings.value = new Map();
      this.homed.value = "";
      this.restarted.value = this.parked.value = false;
      this.notParked.value = "";
      this.version.value = this.options.value = this.modes.value = "";
    });
    this.takenBy.value = "";
    this.asksStart = true;
    this.doubt(QUESTIONS);
    this.isSerial = transport.isSerial;
    this.splitter = new LineSplitter();
    this.queue.forget();
    this.queue.capacity = SMALLEST_BUFFER;
    this.waitsForReport = false;
    this.unheard = 0;
    this.heardAt = performance.now();
  }

  private hearFirstWord(): Promise<boolean> {
    return new Promise((resolve) => {
      const timer = setTimeout(() => resolve(false), FIRST_WORD_MS);
      this.firstWord = () => {
        clearTimeout(timer);
        this.firstWord = null;
        resolve(true);
      };
    });
  }

  private tick(): void {
    const now = performance.now();
    const every = MOVING.has(this.state.value) ? ASK_MOVING_MS : ASK_RESTING_MS;
    const mayBeSilent = (this.homing.value && !this.startId.peek()) || this.needsReset.value; // Grbl's silence, not ours
    const since = Math.max(this.heardAt, this.waitsSince - ASK_RESTING_MS);
    const silent_ms = mayBeSilent || !this.waitsForReport ? 0 : now - since;
    this.silent.value = silent_ms > SILENT_MS;
    if (silent_ms > DEAD_MS && !this.isSerial && !this.firstWord) return this.lose(t`nothing was received for ${DEAD_MS / 1000} s`);
    const asksAgain = this.waitsForReport;
    if (now - this.askedAt < (asksAgain ? SILENT_MS / 2 : every)) return;
    this.askedAt = now;
    if (!this.waitsForReport) this.waitsSince = now;
    this.waitsForReport = true;
    // While it homes, which another client may have begun, a WiFiCNC answers this one alone.
    if (this.asksStart || asksAgain || this.state.value === "Home") this.realtime("FULL_STATUS");
    this.realtime("STATUS");
    this.asksStart = false;
  }

  private write(bytes: Uint8Array): void {
    this.transport?.write(bytes).catch((error: unknown) => this.lose(String(error)));
  }

  private lose(why: string): void {
    const transport = this.transport;
    if (!transport) return;
    clearInterval(this.timer);
    this.transport = null;
    this.lostWhy.value = why;
    this.link.value = "lost";
    this.note("page", t`The connection was lost: ${why}`, true);
    this.queue.forget();
    this.onBreak("lost");
    void transport.close();
  }

  private hear(data: Uint8Array): void {
    this.heardAt = performance.now();
    this.silent.value = false;
    batch(() => {
      for (const text of this.splitter.take(data)) this.take(text, parse(text));
    });
    this.flush();
    this.onRoom();
    void this.catchUp();
  }

  private take(text: string, message: Message): void {
    const isFirst = this.firstWord !== null;
    if (message.kind !== "other") this.firstWord?.();
    if (message.kind === "status") {
      if (this.reportAsked) this.note("controller", text);
      this.reportAsked = false;
      this.takeStatus(message.status);
      return;
    }
    const quiet = this.queue.answersQuietly;
    if (message.kind === "ok" || message.kind === "error") {
      const mine = this.queue.answer(message.kind === "ok" ? null : message.code);
      if (mine && !(message.kind === "error" && NOT_TAKEN.has(message.code))) this.role.value = "owner";
      if (message.kind === "error" && mine && !quiet) this.note("controller", `${text}  ${errorWords(message.code)}`, true);
      return;
    }
    if (message.kind === "alarm") {
      this.alarm.value = message.code;
      this.homed.value = "";
      this.onAlarm(message.code);
      this.note("controller", `${text}  ${alarmWords(message.code)}`, true);
      return;
    }
    if (!quiet || (message.kind === "bracket" && message.key === "MSG")) this.note("controller", text);
    if (message.kind === "setting") this.settings.value = new Map(this.settings.value).set(message.number, message.value);
    if (message.kind === "banner") this.takeBanner(isFirst);
    else if (message.kind === "bracket") this.takeBracket(message.key, message.body);
    this.queue.hear(text);
  }

  private isOwnReset(): boolean {
    this.resetsMore = this.resetsMore.filter((at) => performance.now() - at < OWN_RESET_MS);
    const isOwn = this.resetAsked || this.resetsMore.shift() !== undefined;
    this.resetAsked = false;
    return isOwn;
  }

  private takeBanner(isFirst: boolean): void {
    const isOwn = this.isOwnReset();
    this.resets++;
    if (!isOwn) this.homed.value = ""; // it may have been without power
    if (!isOwn && !isFirst) this.restarted.value = true;
    this.alarm.value = null;
    this.endToolChange();
    this.needsReset.value = this.waitsForReport = this.parked.value = false;
    this.notParked.value = this.driverSays.value = this.selfLock.value = "";
    this.askedAt = 0; // what was reported is old
    this.asksStart = true;
    this.doubt(QUESTIONS);
    this.queue.forget();
    this.onBreak("reset");
  }

  private takeStatus(status: Status): void {
    this.waitsForReport = false;
    this.heard++;
    this.unheard = 0;
    this.status.value = status;
    if (status.start) this.takeStart(status.start);
    if (!HELD.has(status.state)) this.endToolChange();
    if (!HELD.has(status.state) && this.parked.value) this.unpark(); // someone else has resumed it
    if (status.wco) this.takeOffset(status.wco);
    if (status.overrides) {
      this.overrides.value = status.overrides;
      this.accessories.value = status.accessories ?? "";
    }
    if (status.mpg !== undefined) this.mpg.value = status.mpg;
    if (status.state === "Alarm" || status.state === "Sleep") this.homed.value = "";
    if (status.state !== "Alarm") {
      this.alarm.value = null;
      this.selfLock.value = "";
    }
    this.onReport(status);
  }

  private endToolChange(): void {
    this.awaitedTool.value = null;
    this.notMeasured.value = "";
  }

  /** Another start than the one whose position is known: over a lost link, a reload, and a change of clients. */
  private takeStart(start: string): void {
    const before = this.startId.peek();
    this.startId.value = start;
    if (before && before !== start) this.losePosition();
    else if (this.version.peek() === "" && this.settings.peek().size === 0) this.recall();
  }

  /** A job that was kept over a reload was sent to this start of the controller. */
  expectStart(start: string): void {
    if (!start) return;
    if (!this.startId.peek()) this.startId.value = start;
    else if (this.startId.peek() !== start) this.losePosition();
  }

  /** Homed, or the operator has set a new zero and says so. */
  findPosition(): void {
    this.positionLost.value = false;
    this.keep({ isLost: false });
  }

  private losePosition(): void {
    this.homed.value = "";
    this.positionLost.value = true;
    this.keep({ isLost: true });
    this.restarted.value = false; // the notice of a reset says less
    this.queue.forget();
    this.onBreak("restarted");
    this.doubt(QUESTIONS);
  }

  /** Another offset than before: whoever changed it, the offsets and the work system may be others, too. */
  private takeOffset(wco: number[]): void {
    if (String(wco) !== String(this.wco.peek())) this.doubt(["$#", "$G"]);
    this.wco.value = wco;
  }

  private takeBracket(key: string, body: string): void {
    if (key === "MSG") this.takeMessage(body);
    else if (key === "VER") this.version.value = body;
    else if (key === "START") this.takeStart(body);
    else if (key === "GC") this.modes.value = body;
    else if (key === "OPT") {
      this.options.value = body;
      this.queue.capacity = (receiveBuffer(body) ?? SMALLEST_BUFFER + 1) - 1;
    } else if (OFFSET.test(key)) this.offsets.value = new Map(this.offsets.value).set(key, body);
  }

  private takeMessage(body: string): void {
    this.onMessage(body);
    if (JOG_STOPPED.test(body)) {
      this.othersStops++;
      this.onJogStopped();
    }
    if (NEEDS_RESET.test(body)) this.needsReset.value = true;
    this.selfLock.value = this.needsReset.value ? "" : (SELF_LOCKS.find(([text]) => text.test(body))?.[1] ?? this.selfLock.value);
    const tool = TOOL_CHANGE.exec(body)?.[1];
    if (tool) this.awaitedTool.value = Number(tool);
    if (NOT_MEASURED.test(body)) this.notMeasured.value = body;
    else if (MEASURED.test(body)) this.notMeasured.value = "";
    if (PARKED.test(body)) {
      this.parked.value = true;
      this.notParked.value = "";
      this.queue.park();
    }
    const notParked = NOT_PARKED.exec(body)?.[1];
    if (notParked) {
      this.notParked.value = notParked;
      this.unpark();
    }
    if (DRIVER_SAYS.test(body)) this.driverSays.value = body;
    if (LOCKED.test(body)) this.locked.value = true;
    if (NOBODY.test(body)) this.role.value = "nobody";
    if (IN_CONTROL.test(body)) this.beInControl();
    if (!OBSERVER.test(body) || NOBODY.test(body)) return;
    this.takenBy.value = OBSERVED.exec(body)?.[1] ?? "";
    this.role.value = "observer";
    this.homed.value = "";
    this.queue.forget();
    this.onBreak("taken");
  }

  /** By its message: the `ok` of `$TAKE` may come behind a line of before. */
  private beInControl(): void {
    this.role.value = "owner";
    this.doubt(QUESTIONS);
  }
}

function settingsIn(said: readonly string[]): Map<number, string> {
  const rows = said.map(parse).filter((message) => message.kind === "setting");
  return new Map(rows.map(({ number, value }) => [number, value]));
}

/** Hold:1 slows down, as Door:2 does; Door:3 comes back. */
function moves({ state, substate }: Status): boolean {
  return MOVING.has(state) || (state === "Hold" && substate === 1) || (state === "Door" && (substate ?? 0) > 1);
}

/** After this line the machine's position may not be what homing made it. */
function forgetsHome(line: string): boolean {
  const number = /^\$(\d+)=/.exec(line)?.[1];
  return number === undefined ? FORGETS_HOME.test(line) : MOVES_ZERO.has(Number(number));
}
