/**
 * The controller's own core as WebAssembly (web/wasm/preflight.c): the same parser, planner and steps as on the board,
 * in virtual time. Runs in a worker; nothing here touches the page.
 */
import { TABLES, type HostField } from "../tables";
import { t } from "../words";

export interface Report {
  seconds: number;
  cutting_seconds: number;
  rapid_seconds: number;
  /** Of the file. */
  lines: number;
  min_mm: number[];
  max_mm: number[];
  max_speed_mm_s: number[];
  max_accel_mm_s2: number[];
  max_step_rate_hz: number;
  errors: CoreError[];
  error_count: number;
  /** M6, the first of them: where the machine waits for another tool. */
  tool_changes: { line: number; tool: number }[];
  tool_change_count: number;
  /** [MSG:...] of the controller. */
  messages: string[];
  engraving: EngravingReport;
}

/** struct engraving_result of targets/sim/engraving.h: what constant power burns. */
export interface EngravingReport {
  constant_mm: number;
  slow_mm: number;
  limit: number;
  worst: number;
  worst_line: number;
  worst_mm: number[];
}

/** kind: enum sim_error_kind of targets/sim/sim.h. */
export interface CoreError {
  /** 1-based in the file; 0: before the first one. */
  line: number;
  code: number;
  kind: ErrorKind;
}

export const enum ErrorKind {
  Error = 0,
  Alarm = 1,
  NoAnswer = 2,
  Surplus = 3,
  Held = 4,
  Reset = 5,
}

/** struct rebuild_state of targets/sim/rebuild.h. */
export interface Modes {
  work_mm: number[];
  machine_mm: number[];
  g92_mm: number[];
  top_z_mm: number | null;
  tool_length_mm: number;
  feed_mm_min: number;
  spindle_rpm: number;
  path_tolerance_mm: number;
  tool: number;
  motion_g10: number;
  path_g10: number;
  wcs_g10: number;
  plane_g: number;
  units_g: number;
  distance_g: number;
  feed_mode_g: number;
  spindle_m: number;
  coolant: number;
  arc_absolute: number;
  moved: number;
  stored: number;
}

/** struct path_sample: t_s, six positions in mm, speed in mm/s as floats, then rapid as a u32. */
export const SAMPLE_WORDS = 9;

/** struct engraving_piece: t_s, X Y Z where it begins and ends, length in mm, energy in s at full power. */
export const PIECE_WORDS = 9;

type Address = number;

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  core_alloc(size: number): Address;
  core_free(memory: Address): void;
  core_axes(): Address;
  core_open(...board: number[]): number;
  core_command(line: Address): number;
  core_load(text: Address, size: number, sample_ms: number): number;
  core_run(maxEvents: number): number;
  core_lines_done(): number;
  core_line_now(): number;
  core_seconds(): number;
  core_sample_count(): number;
  core_samples(): Address;
  core_piece_count(): number;
  core_pieces(): Address;
  core_report(): Address;
  core_rebuild(axes: number): number;
  core_rebuild_offset(row: number): number;
  core_rebuild_line(line: Address, size: number): number;
  core_rebuild_report(): Address;
}

const BOARD_FIELDS: readonly HostField[] = [
  "timer_hz",
  "step_pulse_ns",
  "default_pulse_us",
  "dir_setup_ns",
  "max_step_rate_hz",
  "axes",
  "ganged",
  "missing_outputs",
  "digital_inputs",
  "digital_outputs",
  "encoder",
  "analog",
  "home_axes",
  "toolsetter",
  "spindle_bus",
];

/** WASI's "no such file": none exist, the core opens none and asks for no time. */
const EBADF = 8;

function system(): WebAssembly.ModuleImports {
  const refuse = (): number => EBADF;
  return new Proxy({} as WebAssembly.ModuleImports, { get: () => refuse });
}

export class Core {
  private constructor(private readonly c: Exports) {}

  static async load(module: BufferSource): Promise<Core> {
    const { instance } = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: system() });
    const exports = instance.exports as unknown as Exports;
    exports._initialize();
    return new Core(exports);
  }

  open(board: Record<HostField, number>): void {
    if (this.c.core_open(...BOARD_FIELDS.map((name) => board[name])) !== 0) throw new Error(t`no memory for the core`);
  }

  /** A line before the job. @returns 0, N of error:N, or -1: no answer */
  command(line: string): number {
    return this.withText(`${line}\0`, (address) => this.c.core_command(address));
  }

  begin(job: string, sampleMs: number): void {
    const failed = this.withText(job, (address, size) => this.c.core_load(address, size, sampleMs));
    if (failed) throw new Error(t`no memory for the job`);
  }

  /** @returns whether there is more */
  run(maxEvents: number): boolean {
    return this.c.core_run(maxEvents) !== 0;
  }

  get linesDone(): number {
    return this.c.core_lines_done();
  }

  /** The line in the file that is being moved; 0: none yet. */
  get lineNow(): number {
    return this.c.core_line_now();
  }

  get seconds(): number {
    return this.c.core_seconds();
  }

  report(): Report {
    return JSON.parse(this.text(this.c.core_report())) as Report;
  }

  /** A copy of the path, SAMPLE_WORDS words a sample. */
  samples(): Float32Array<ArrayBuffer> {
    return this.floats(this.c.core_samples(), this.c.core_sample_count() * SAMPLE_WORDS);
  }

  /** A copy of what a laser burns, PIECE_WORDS words a piece. */
  pieces(): Float32Array<ArrayBuffer> {
    return this.floats(this.c.core_pieces(), this.c.core_piece_count() * PIECE_WORDS);
  }

  /** Power-on state at this place (machine coordinates). */
  rebuild(axisCount: number, machineMm: readonly number[]): void {
    this.setAxes(machineMm);
    if (this.c.core_rebuild(axisCount) !== 0) throw new Error(t`no memory for the core`);
  }

  /** A row of `$#`: 0.. = G54.., -28, -30, -92, -43 = tool length. */
  rebuildOffset(row: number, mm: readonly number[]): void {
    this.setAxes(mm);
    this.c.core_rebuild_offset(row);
  }

  /** @returns 0, or N of error:N */
  rebuildLine(line: string): number {
    return this.withText(line, (address, size) => this.c.core_rebuild_line(address, size));
  }

  modes(): Modes {
    return JSON.parse(this.text(this.c.core_rebuild_report())) as Modes;
  }

  private setAxes(mm: readonly number[]): void {
    const axes = new Float64Array(this.c.memory.buffer, this.c.core_axes(), TABLES.axes.length);
    axes.fill(0);
    axes.set(mm.slice(0, axes.length));
  }

  private withText(text: string, use: (address: Address, size: number) => number): number {
    const bytes = new TextEncoder().encode(text);
    const address = this.c.core_alloc(bytes.length + 1);
    if (!address) throw new Error(t`no memory for the text`);
    new Uint8Array(this.c.memory.buffer, address, bytes.length).set(bytes);
    const result = use(address, bytes.length);
    this.c.core_free(address);
    return result;
  }

  private floats(address: Address, count: number): Float32Array<ArrayBuffer> {
    return new Float32Array(this.c.memory.buffer, address, count).slice() as Float32Array<ArrayBuffer>;
  }

  private text(address: Address): string {
    const bytes = new Uint8Array(this.c.memory.buffer, address);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
}
