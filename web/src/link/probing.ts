/**
 * Probing cycles: what they send, step by step, and what follows from the contacts. Every approach is G38.3, which ends at
 * a contact and is no alarm without one; so is every move that goes near the work and must not touch it. Pure.
 *
 * Contacts are machine coordinates of the tool's centre or tip, mm. Moves are relative (G91), so a cycle begins where the
 * tool is.
 */
import { AXES } from "../tables";
import { msg, t, tr } from "../words";

export type Cycle = "plate" | "corner" | "hole" | "boss" | "edge" | "rotation" | "length";
export type Sign = 1 | -1;

export interface ProbeValues {
  /** Of the plate under the tool; 0: the work itself is touched. */
  thickness_mm: number;
  /** Of the plate's wall next to the work, which lies between the tool and the work. */
  wall_mm: number;
  tool_mm: number;
  /** How far an approach goes before it gives up. */
  reach_mm: number;
  /** From the start out over the edge, and down next to it. */
  out_mm: number;
  down_mm: number;
  /** Of a boss: about how wide it is, along X and along Y. Of a rotation: from the first contact to the second. */
  width_mm: number;
  feed_mm_min: number;
  /** Which corner, or which side of the work an edge is on: -1 is left or front. */
  side: Record<"X" | "Y", Sign>;
  edge: "X" | "Y";
}

export const USUAL: ProbeValues = {
  thickness_mm: 10,
  wall_mm: 0,
  tool_mm: 6,
  reach_mm: 20,
  out_mm: 20,
  down_mm: 6,
  width_mm: 40,
  feed_mm_min: 150,
  side: { X: -1, Y: -1 },
  edge: "X",
};

export type Step =
  /** Must touch; the contact has this name. */
  | { kind: "touch"; line: string; name: string; axis: string }
  /** Must not touch. */
  | { kind: "clear"; line: string }
  | { kind: "jog"; line: string }
  /** To the middle between two contacts. */
  | { kind: "middle"; axis: string; of: readonly [string, string]; feed_mm_min: number }
  /** Where the tool has touched is its length, or the reference of the next ones. */
  | { kind: "length"; of: string }
  /** The work position of an axis is value_mm where the machine is at the mean of these contacts, plus shift_mm. */
  | { kind: "set"; axis: string; of: readonly string[]; shift_mm: number; value_mm: number };

const BACK_OFF_MM = 2;
const SLOW_PART = 0.25;
const LIFT_FEED = 600;
const LIMITS: readonly [keyof ProbeValues, string, number, number][] = [
  ["thickness_mm", msg`The thickness of the plate`, 0, 100],
  ["wall_mm", msg`The wall of the plate`, 0, 50],
  ["tool_mm", msg`The diameter of the tool`, 0, 100],
  ["reach_mm", msg`The reach`, 1, 200],
  ["out_mm", msg`The way out`, 1, 200],
  ["down_mm", msg`The way down`, 0.5, 100],
  ["width_mm", msg`The width`, 1, 1000],
  ["feed_mm_min", msg`The feed`, 10, 500],
];

/** What is wrong with these numbers; "": nothing. */
export function probeProblem(values: ProbeValues): string {
  for (const [name, text, low, high] of LIMITS) {
    const value = values[name] as number;
    if (!(value >= low && value <= high)) return t`${tr(text)} must be from ${low} to ${high}.`;
  }
  return "";
}

export function planProbe(cycle: Cycle, values: ProbeValues): Step[] {
  switch (cycle) {
    case "plate":
      return [...touchDown(values), lift(values)];
    case "edge":
      return [...touch(values.edge, -values.side[values.edge] as Sign, "edge", values), setEdge(values.edge, "edge", values)];
    case "corner":
      return corner(values);
    case "hole":
      return (["X", "Y"] as const).flatMap((axis) => hole(axis, values));
    case "boss":
      return (["X", "Y"] as const).flatMap((axis) => boss(axis, values));
    case "rotation":
      return rotation(values);
    case "length":
      return [...touch("Z", -1, "Z", values), { kind: "length", of: "Z" }, lift(values)];
  }
}

/** For the eye, before it is sent. */
export function stepText(step: Step): string {
  if (step.kind === "middle") return `$J=G53G21G90${step.axis}(middle of ${step.of.join(" and ")})F${step.feed_mm_min}`;
  if (step.kind === "length") return `G21G43.1Z(contact less that of the reference)`;
  if (step.kind === "set") return `G21G10L20P0${step.axis}(position against ${step.of.join(" and ")})`;
  return step.line;
}

/** Quickly until it touches, back, and once more slowly; then clear of it. */
function touch(axis: string, sign: Sign, name: string, values: ProbeValues): Step[] {
  const approach = (mm: number, feed: number): string => `G21G91G94G38.3${axis}${number(sign * mm)}F${number(feed)}`;
  const back: Step = { kind: "jog", line: `$J=G21G91${axis}${number(-sign * BACK_OFF_MM)}F${number(values.feed_mm_min)}` };
  return [
    { kind: "touch", line: approach(values.reach_mm, values.feed_mm_min), name, axis },
    back,
    { kind: "touch", line: approach(2 * BACK_OFF_MM, values.feed_mm_min * SLOW_PART), name, axis },
    back,
  ];
}

function touchDown(values: ProbeValues): Step[] {
  return [...touch("Z", -1, "Z", values), { kind: "set", axis: "Z", of: ["Z"], shift_mm: 0, value_mm: values.thickness_mm }];
}

function lift(values: ProbeValues): Step {
  return { kind: "jog", line: `$J=G21G91Z${number(values.down_mm)}F${LIFT_FEED}` };
}

function clear(axis: string, mm: number, values: ProbeValues): Step {
  return { kind: "clear", line: `G21G91G94G38.3${axis}${number(mm)}F${number(2 * values.feed_mm_min)}` };
}

/** The surface is half a tool, and the wall of the plate, beyond the centre of the tool. */
function setEdge(axis: "X" | "Y", name: string, values: ProbeValues): Step {
  return { kind: "set", axis, of: [name], shift_mm: -values.side[axis] * (values.tool_mm / 2 + values.wall_mm), value_mm: 0 };
}

/** Down on the plate, then out over each edge, down next to it, and back against it. */
function corner(values: ProbeValues): Step[] {
  const down_mm = values.down_mm + BACK_OFF_MM;
  const against = (axis: "X" | "Y"): Step[] => [
    clear(axis, values.side[axis] * values.out_mm, values),
    clear("Z", -down_mm - values.down_mm, values),
    ...touch(axis, -values.side[axis] as Sign, axis, values),
    { kind: "jog", line: `$J=G21G91Z${number(down_mm + values.down_mm)}F${LIFT_FEED}` },
    setEdge(axis, axis, values),
    { kind: "middle", axis, of: [`start ${axis}`, `start ${axis}`], feed_mm_min: LIFT_FEED },
  ];
  return [...touchDown(values), lift(values), ...against("X"), ...against("Y")];
}

function hole(axis: "X" | "Y", values: ProbeValues): Step[] {
  const [low, high] = [`${axis}−`, `${axis}+`];
  return [
    ...touch(axis, -1, low, values),
    { kind: "middle", axis, of: [`start ${axis}`, `start ${axis}`], feed_mm_min: values.feed_mm_min },
    ...touch(axis, 1, high, values),
    { kind: "middle", axis, of: [low, high], feed_mm_min: values.feed_mm_min },
    { kind: "set", axis, of: [low, high], shift_mm: 0, value_mm: 0 },
  ];
}

/** From above its middle: out, down, against it, up, and the same on the other side. */
function boss(axis: "X" | "Y", values: ProbeValues): Step[] {
  const out_mm = values.width_mm / 2 + values.tool_mm / 2 + values.out_mm;
  const against = (sign: Sign, name: string): Step[] => [
    clear(axis, sign * out_mm, values),
    clear("Z", -values.down_mm, values),
    ...touch(axis, -sign as Sign, name, values),
    lift(values),
    { kind: "middle", axis, of: [`start ${axis}`, `start ${axis}`], feed_mm_min: LIFT_FEED },
  ];
  const [low, high] = [`${axis}−`, `${axis}+`];
  return [
    ...against(-1, low),
    ...against(1, high),
    { kind: "middle", axis, of: [low, high], feed_mm_min: LIFT_FEED },
    { kind: "set", axis, of: [low, high], shift_mm: 0, value_mm: 0 },
  ];
}

/** The same edge twice, some way apart, and back to where it began. */
function rotation(values: ProbeValues): Step[] {
  const [across, along] = values.edge === "X" ? (["X", "Y"] as const) : (["Y", "X"] as const);
  const back = (axis: string): Step => ({ kind: "middle", axis, of: [`start ${axis}`, `start ${axis}`], feed_mm_min: 2 * values.feed_mm_min });
  const against = (name: string): Step[] => [...touch(across, -values.side[across] as Sign, name, values), back(across)];
  return [...against("first"), clear(along, values.width_mm, values), ...against("second"), back(along)];
}

/** By how much the edge of a rotation is turned: degrees, counter-clockwise from above. */
export function edgeAngle_deg({ edge, width_mm }: ProbeValues, contacts: ReadonlyMap<string, number>): number {
  const turn = (Math.atan2(contacts.get("second")! - contacts.get("first")!, width_mm) * 180) / Math.PI;
  return edge === "X" ? -turn : turn;
}

// ---- running it ----

export interface ProbeMachine {
  /** Rejects when the line is refused. */
  send(line: string): Promise<string[]>;
  /** Rejects when it does not come to rest. */
  rest(): Promise<void>;
  /** A jog, until the machine rests. Rejects when it is refused, or stopped before its end by anyone. */
  move(line: string): Promise<void>;
  machine_mm(): readonly number[];
  /** Unit of `[PRB:]`. */
  report_mm(): number;
  /** The probe input is on. */
  isTouching(): boolean;
  setPosition(axis: string, value_mm: number): Promise<void>;
  /** @param contact_mm  machine position of Z where the tool touched */
  setLength(contact_mm: number): Promise<void>;
}

export class ProbeError extends Error {}

/** Rejects at the first step that does not end as it must; what was set before stays set. @param ended  why the cycle may not
 * continue; "": it may @returns the contacts */
export async function runProbe(steps: readonly Step[], machine: ProbeMachine, ended: () => string): Promise<Map<string, number>> {
  const start_mm = machine.machine_mm();
  if (start_mm.length === 0) throw new ProbeError(t`The controller has not reported its position and its work offset yet. Try again in a moment.`);
  const contacts = new Map([...AXES].map((axis, i) => [`start ${axis}`, start_mm[i] ?? 0]));
  if (machine.isTouching()) throw new ProbeError(t`The probe is in contact already: nothing was moved. Lift the tool off, and check the clip.`);
  const mayContinue = (): void => {
    const why = ended();
    if (why) throw new ProbeError(why);
  };
  for (const step of steps) {
    mayContinue();
    await runStep(step, machine, contacts, mayContinue);
  }
  mayContinue();
  return contacts;
}

async function runStep(step: Step, machine: ProbeMachine, contacts: Map<string, number>, mayContinue: () => void): Promise<void> {
  const mean = (names: readonly string[]): number => names.reduce((sum, name) => sum + contacts.get(name)!, 0) / names.length;
  if (step.kind === "set") {
    const here_mm = machine.machine_mm()[AXES.indexOf(step.axis)]!;
    return machine.setPosition(step.axis, step.value_mm + here_mm - (mean(step.of) + step.shift_mm));
  }
  if (step.kind === "length") return machine.setLength(contacts.get(step.of)!);
  if (step.kind === "middle") return machine.move(`$J=G53G21G90${step.axis}${number(mean(step.of))}F${number(step.feed_mm_min)}`);
  if (step.kind === "jog") {
    await machine.move(step.line);
    if (machine.isTouching()) throw new ProbeError(t`The probe is still in contact after the tool was moved away: the cycle ended here.`);
    return undefined;
  }
  const said = await machine.send(step.line);
  mayContinue(); // a job that was resumed meanwhile would be waited for
  await machine.rest();
  mayContinue();
  return takeContact(step, contactOf(said), machine, contacts);
}

function takeContact(step: Step & { kind: "touch" | "clear" }, found: Contact, machine: ProbeMachine, contacts: Map<string, number>): void {
  if (step.kind === "clear") {
    if (found.touched) throw new ProbeError(t`The tool touched something on a move that must be free: the cycle ended here, at the contact.`);
    return;
  }
  if (!found.touched) throw new ProbeError(t`The probe found nothing on its way along ${step.axis}: nothing was set for it.`);
  contacts.set(step.name, found.at[AXES.indexOf(step.axis)]! * machine.report_mm());
}

interface Contact {
  touched: boolean;
  at: number[];
}

/** `[PRB:x,y,z:1]` */
function contactOf(said: readonly string[]): Contact {
  const match = said.map((text) => /^\[PRB:([-\d.,]+):([01])\]$/.exec(text)).find((found) => found !== null);
  if (!match) throw new ProbeError(t`The controller has not reported where the probe is.`);
  return { touched: match[2] === "1", at: match[1]!.split(",").map(Number) };
}

function number(value: number): string {
  return String(Number(value.toFixed(3)));
}
