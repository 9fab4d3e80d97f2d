/** What a Grbl 1.1 controller says, line by line. Pure. A line that fits no form is "other", never an error. */

export interface Status {
  /** Idle Run Hold Tool Jog Alarm Door Check Home Sleep */
  state: string;
  substate: number | null;
  mpos: number[] | null;
  wpos: number[] | null;
  wco: number[] | null;
  plannerFree: number | null;
  rxFree: number | null;
  line: number | null;
  feed: number | null;
  speed: number | null;
  /** Of the spindle, by its encoder or drive; null: nothing measures it. */
  measured: number | null;
  /** Of a drive's motor; null: it is not reported. */
  ampere: number | null;
  pins: string;
  /** Percent: feed, rapid, spindle. */
  overrides: [number, number, number] | null;
  /** S spindle cw, C ccw, F flood, M mist; null: the report does not say. */
  accessories: string | null;
  /** A pendant has control (0x8B); left out: the report does not say. */
  mpg?: boolean;
  /** Another one after each start of the controller; left out: the report does not say. */
  start?: string;
}

export type Message =
  | { kind: "ok" }
  | { kind: "error"; code: number }
  | { kind: "alarm"; code: number }
  | { kind: "banner"; text: string }
  | { kind: "setting"; number: number; value: string }
  | { kind: "bracket"; key: string; body: string }
  | { kind: "status"; status: Status }
  | { kind: "other"; text: string };

const NUMBERED = /^(error|ALARM):(\d{1,4})$/;
const BANNER = /^Grbl\w* \S+( .*)?$/;
const SETTING = /^\$(\d{1,5})=([^\s=]*)( \(.*\))?$/;
const BRACKET = /^\[([A-Z][A-Z0-9.]*):(.*)\]$/;

/** Modes of the last `$G`, with the spindle as reports show it since: a program's M3 is not asked for. */
export function modesNow(modes: string, accessories: string, rpm: number): string {
  const turns = accessories.includes("C") ? "M4" : accessories.includes("S") ? "M3" : "";
  return modes.replace(/\bM[345]\b/, (word) => turns || (rpm > 0 ? word : "M5"));
}

/** One line without its end. */
export function parse(text: string): Message {
  if (text === "ok") return { kind: "ok" };
  let match = NUMBERED.exec(text);
  if (match) return { kind: match[1] === "error" ? "error" : "alarm", code: Number(match[2]) };
  if (text.startsWith("<") && text.endsWith(">")) {
    const status = parseStatus(text);
    return status ? { kind: "status", status } : { kind: "other", text };
  }
  if ((match = BRACKET.exec(text))) return { kind: "bracket", key: match[1]!, body: match[2]! };
  if ((match = SETTING.exec(text))) return { kind: "setting", number: Number(match[1]), value: match[2]! };
  return BANNER.test(text) ? { kind: "banner", text } : { kind: "other", text };
}

/** null when a field that we know is not what it should be. */
function parseStatus(text: string): Status | null {
  const [head = "", ...parts] = text.slice(1, -1).split("|");
  const [state = "", substate] = head.split(":");
  const status: Status = {
    state,
    substate: substate !== undefined && /^\d+$/.test(substate) ? Number(substate) : null,
    mpos: null,
    wpos: null,
    wco: null,
    plannerFree: null,
    rxFree: null,
    line: null,
    feed: null,
    speed: null,
    measured: null,
    ampere: null,
    pins: "",
    overrides: null,
    accessories: null,
  };
  const good = parts.every((part) => {
    const colon = part.indexOf(":");
    return colon < 0 || takeField(status, part.slice(0, colon), part.slice(colon + 1));
  });
  return good && /^[A-Za-z]+$/.test(state) && (status.mpos || status.wpos) ? status : null;
}

function takeField(status: Status, key: string, value: string): boolean {
  if (key === "Pn") {
    status.pins = value;
    return true;
  }
  if (key === "A") {
    status.accessories = value;
    return true;
  }
  if (key === "MPG") status.mpg = value === "1";
  if (key === "Start") status.start = value;
  const numbers = value.split(",").map(Number);
  const known = ["MPos", "WPos", "WCO", "Bf", "Ln", "F", "FS", "Ov", "Amp"].includes(key);
  if (!known) return true;
  if (numbers.some((number) => !Number.isFinite(number)) || value === "") return false;
  const [first = 0, second = 0, third = 0] = numbers;
  if (key === "MPos") status.mpos = numbers;
  else if (key === "WPos") status.wpos = numbers;
  else if (key === "WCO") status.wco = numbers;
  else if (key === "Bf") [status.plannerFree, status.rxFree] = [first, second];
  else if (key === "Ln") status.line = first;
  else if (key === "F") status.feed = first;
  else if (key === "FS") {
    [status.feed, status.speed] = [first, second];
    status.measured = numbers[2] ?? null;
  } else if (key === "Amp") status.ampere = first;
  else if (key === "Ov") status.overrides = [first, second, third];
  return true;
}

/** Bytes -> whole lines, however they were cut on the way; empty ones are left out. */
export class LineSplitter {
  private rest = "";
  private readonly decoder = new TextDecoder();

  take(bytes: Uint8Array): string[] {
    const lines = (this.rest + this.decoder.decode(bytes, { stream: true })).split(/[\r\n]/);
    this.rest = lines.pop() ?? "";
    return lines.map((line) => line.trim()).filter((line) => line !== "");
  }
}

/** [OPT:VNMH,253,2048]: bytes of the receive buffer; null when it gives none. */
export function receiveBuffer(body: string): number | null {
  const size = Number(body.split(",")[2]);
  return Number.isInteger(size) && size > 0 ? size : null;
}
