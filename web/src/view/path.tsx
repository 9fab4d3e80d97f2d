/** The path of the job, as the core has moved along it: from above, or turned by hand. */
import { signal, useSignal } from "@preact/signals";
import type { CanvasHTMLAttributes, JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { controller, job, preflight, theme } from "../app";
import { SAMPLE_WORDS } from "../job/core";
import { secondsAtLine, type Preflight } from "../job/preflight";
import { gridOf, projection, SLANTED, TOP, type Box, type Project, type View } from "../job/projection";
import { Segments } from "./parts";

/** Samples drawn; more cannot be told apart. */
const POINTS_MAX = 60_000;
const GRID_LINES = 10;
/** Of a number at the left of the grid, and where it stands at the edge, px. */
const LABEL_WIDTH = 26;
const LABEL_EDGE = 3;
const ZOOM_MIN = 0.3;
const ZOOM_MAX = 60;

type Kind = "top" | "slanted";

const view = signal<View>(TOP);

export function PathView({ preflight: done }: { preflight: Preflight }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  const kind = useSignal<Kind>("top");
  const choose = (next: Kind): void => {
    kind.value = next;
    view.value = next === "top" ? TOP : SLANTED;
  };
  useDrawing(canvas, done);
  return (
    <div class="path">
      <canvas ref={canvas} role="img" aria-label={describePath(done)} {...gestures(kind.value)} />
      <Segments
        label="View"
        value={kind.value}
        options={[
          { value: "top" as Kind, text: "Top" },
          { value: "slanted" as Kind, text: "3-D" },
        ]}
        onChange={choose}
      />
      <div class="legend" aria-hidden="true">
        <span>cut</span>
        <span class="rapid">rapid</span>
        <span class="tool">tool</span>
      </div>
    </div>
  );
}

function describePath(done: Preflight): string {
  const size = done.report.max_mm.slice(0, 3).map((high, i) => (high - done.report.min_mm[i]!).toFixed(1));
  return `Path of ${done.program.name}: ${size.join(" by ")} mm`;
}

/** Draw again when the machine moves, the view turns or the colours change. */
function useDrawing(ref: { current: HTMLCanvasElement | null }, done: Preflight): void {
  const tool = toolPosition();
  const seconds = job.answered.value > 0 ? secondsAtLine(done.timeline, job.lastAnsweredLine.value) : 0;
  const dependencies = [done, view.value, theme.value, tool?.join(), seconds];
  useEffect(() => {
    const canvas = ref.current;
    if (!canvas) return undefined;
    const redraw = (): void => draw(canvas, done, seconds, tool);
    const observer = new ResizeObserver(redraw);
    observer.observe(canvas);
    return () => observer.disconnect();
  }, dependencies);
}

/** Of the machine, in the coordinates of the path; null: not connected. */
function toolPosition(): readonly number[] | null {
  return controller.connected.value && controller.machinePosition.value.length > 0 ? controller.machinePosition.value : null;
}

// ---- drawing ----

interface Colours {
  cut: string;
  rapid: string;
  done: string;
  grid: string;
  text: string;
  tool: string;
}

function colours(): Colours {
  const style = getComputedStyle(document.documentElement);
  const read = (name: string): string => style.getPropertyValue(name).trim();
  return {
    cut: read("--path-cut"),
    rapid: read("--path-rapid"),
    done: read("--path-done"),
    grid: read("--path-grid"),
    text: read("--ink-faint"),
    tool: read("--stop"),
  };
}

function boxOf(done: Preflight): Box {
  const { min_mm, max_mm } = done.report;
  return {
    min: [min_mm[0]!, min_mm[1]!, min_mm[2]!],
    max: [max_mm[0]!, max_mm[1]!, max_mm[2]!],
  };
}

function draw(canvas: HTMLCanvasElement, done: Preflight, seconds: number, tool: readonly number[] | null): void {
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const context = canvas.getContext("2d");
  if (!context || width === 0) return;
  canvas.width = width * scale;
  canvas.height = height * scale;
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  context.lineJoin = context.lineCap = "round";
  const grid = gridOf(boxOf(done), GRID_LINES);
  const project = projection(view.value, grid.box, width, height);
  const ink = colours();
  drawGrid(context, grid.step, grid.box, project, ink);
  drawPath(context, done, project, seconds, ink);
  if (tool) drawTool(context, project(tool[0] ?? 0, tool[1] ?? 0, tool[2] ?? 0), ink);
}

function drawGrid(context: CanvasRenderingContext2D, step: number, box: Box, project: Project, ink: Colours): void {
  const [x0, y0] = box.min;
  const [x1, y1] = box.max;
  const z = box.min[2];
  context.strokeStyle = ink.grid;
  context.fillStyle = ink.text;
  context.font = "11px system-ui, sans-serif";
  context.lineWidth = 1;
  context.beginPath();
  const count = (low: number, high: number): number[] => Array.from({ length: Math.round((high - low) / step) + 1 }, (_, i) => low + i * step);
  const label = (value: number): string => String(Number(value.toFixed(3)));
  for (const x of count(x0, x1)) {
    context.moveTo(...project(x, y0, z));
    context.lineTo(...project(x, y1, z));
    const [u, v] = project(x, y0, z);
    context.fillText(label(x), u + 3, v + 12);
  }
  for (const y of count(y0, y1)) {
    context.moveTo(...project(x0, y, z));
    context.lineTo(...project(x1, y, z));
    const [u, v] = project(x0, y, z);
    if (y !== y0) context.fillText(label(y), Math.max(LABEL_EDGE, u - LABEL_WIDTH), v - 3);
  }
  context.stroke();
}

/** Runs of one kind are one stroke each: what is done, cuts, rapids. */
function drawPath(context: CanvasRenderingContext2D, done: Preflight, project: Project, seconds: number, ink: Colours): void {
  const { samples } = done;
  const kinds = new Uint32Array(samples.buffer, samples.byteOffset, samples.length);
  const count = samples.length / SAMPLE_WORDS;
  const skip = Math.max(1, Math.ceil(count / POINTS_MAX));
  const styles = {
    rapid: { colour: ink.rapid, width: 1.2, dash: [5, 4] },
    cut: { colour: ink.cut, width: 1.7, dash: [] as number[] },
    done: { colour: ink.done, width: 1.7, dash: [] as number[] },
  };
  for (const [name, style] of Object.entries(styles)) {
    context.strokeStyle = style.colour;
    context.lineWidth = style.width;
    context.setLineDash(style.dash);
    context.beginPath();
    let drawn = false;
    for (let i = skip; i < count; i += skip) {
      const at = i * SAMPLE_WORDS;
      const before = at - skip * SAMPLE_WORDS;
      const past = samples[at]! <= seconds;
      const kind = past ? "done" : kinds[at + SAMPLE_WORDS - 1] ? "rapid" : "cut";
      if (kind !== name) {
        drawn = false;
        continue;
      }
      if (!drawn) context.moveTo(...project(samples[before + 1]!, samples[before + 2]!, samples[before + 3]!));
      context.lineTo(...project(samples[at + 1]!, samples[at + 2]!, samples[at + 3]!));
      drawn = true;
    }
    context.stroke();
  }
  context.setLineDash([]);
}

function drawTool(context: CanvasRenderingContext2D, [u, v]: [number, number], ink: Colours): void {
  context.fillStyle = ink.tool;
  context.strokeStyle = "#ffffff";
  context.lineWidth = 2;
  context.beginPath();
  context.arc(u, v, 6, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
}

// ---- hands ----

function gestures(kind: Kind): CanvasHTMLAttributes<HTMLCanvasElement> {
  let last: { x: number; y: number } | null = null;
  return {
    onPointerDown: (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      last = { x: event.clientX, y: event.clientY };
    },
    onPointerMove: (event) => {
      if (!last) return;
      const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
      last = { x: event.clientX, y: event.clientY };
      const now = view.value;
      if (kind === "top" || event.shiftKey) view.value = { ...now, shiftX: now.shiftX + dx, shiftY: now.shiftY + dy };
      else view.value = { ...now, turn: now.turn - dx * 0.01, tilt: Math.min(Math.PI / 2, Math.max(0.05, now.tilt + dy * 0.01)) };
    },
    onPointerUp: () => (last = null),
    onPointerCancel: () => (last = null),
    onWheel: (event) => {
      event.preventDefault();
      const zoom = view.value.zoom * Math.exp(-event.deltaY * 0.0015);
      view.value = { ...view.value, zoom: Math.min(ZOOM_MAX, Math.max(ZOOM_MIN, zoom)) };
    },
    onDblClick: () => (view.value = kind === "top" ? TOP : SLANTED),
  };
}

/** Whether there is a path to see. */
export function hasPath(): boolean {
  return (preflight.result.value?.samples.length ?? 0) > 0;
}
