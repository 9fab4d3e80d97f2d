/** The path of the job, as the core has moved along it: from above, or turned by hand. The drawing itself is drawing.ts. */
import { signal, useSignal } from "@preact/signals";
import type { CanvasHTMLAttributes, JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { job, preflight, standing, theme } from "../app";
import { secondsAtLine, type Preflight } from "../job/preflight";
import { pinched, SLANTED, TOP, zoomed, type Box, type Point, type View } from "../job/projection";
import { levelColours, type Scene } from "../job/scene";
import { AXES, TABLES } from "../tables";
import { draw, inkOf } from "./drawing";
import { Segments } from "./parts";
import { t } from "../words";

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
        label={t`View`}
        value={kind.value}
        options={[
          { value: "top" as Kind, text: t`Top` },
          { value: "slanted" as Kind, text: "3-D" },
        ]}
        onChange={choose}
      />
      <Legend scene={done.scene} />
    </div>
  );
}

function describePath(done: Preflight): string {
  const size = done.report.max_mm.slice(0, 3).map((high, i) => (high - done.report.min_mm[i]!).toFixed(1));
  const tool = toolPosition(done)?.slice(0, 3).map((mm, i) => `${AXES[i]} ${mm.toFixed(1)}`);
  return t`Path of ${done.program.name}: ${size.join(t` by `)} mm${tool ? t`; tool at ${tool.join(", ")}` : ""}`;
}

function Legend({ scene }: { scene: Scene }): JSX.Element {
  const { start, end } = TABLES.look;
  const { engraving } = scene;
  const scale = `linear-gradient(to right, ${levelColours(theme.value === "dark", engraving ? "engraving" : "speed").join()})`;
  return (
    <div class="legend" aria-hidden="true">
      <span class="scale" style={{ "--scale": scale }}>
        {engraving ? t`0 to ${engraving.black.toPrecision(3)} ms/mm at full power` : t`0 to ${Math.round(scene.topSpeed_mm_min)} mm/min`}
      </span>
      <span class="rapid" style={{ "--mark": inkOf(theme.value).rapid }}>
        {t`rapid`}
      </span>
      <span class="start" style={{ "--mark": start }}>
        {t`start`}
      </span>
      <span class="end" style={{ "--mark": end }}>
        {t`end`}
      </span>
      <span class="tool">{t`tool`}</span>
    </div>
  );
}

/** Draw again when the machine moves, the view turns or the colours change. */
function useDrawing(ref: { current: HTMLCanvasElement | null }, done: Preflight): void {
  const tool = toolPosition(done);
  const seconds = secondsDone(done);
  const dependencies = [done, view.value, theme.value, tool?.join(), seconds];
  useEffect(() => {
    const canvas = ref.current;
    if (!canvas) return undefined;
    const redraw = (): void => draw(canvas, { scene: done.scene, box: boxOf(done), view: view.value, seconds, tool }, inkOf(theme.value));
    const observer = new ResizeObserver(redraw);
    observer.observe(canvas);
    return () => observer.disconnect();
  }, dependencies);
}

/** Of the simulated time: to the begin of the line that is being moved, or all of it. */
function secondsDone(done: Preflight): number {
  if (job.state.value === "done") return done.report.seconds;
  return job.currentLine.value > 0 ? secondsAtLine(done.timeline, job.currentLine.value) : 0;
}

function boxOf(done: Preflight): Box {
  const { min_mm, max_mm } = done.report;
  const from = (mm: readonly number[], i: number): number => mm[i]! - (done.standing.origin_mm[i] ?? 0);
  return {
    min: [from(min_mm, 0), from(min_mm, 1), from(min_mm, 2)],
    max: [from(max_mm, 0), from(max_mm, 1), from(max_mm, 2)],
  };
}

/** Of the machine, in the coordinates of the path: its zero is the work zero of the check. null: not connected. */
function toolPosition({ standing: checked }: Preflight): readonly number[] | null {
  const { machine_mm } = standing.value;
  return machine_mm.length > 0 ? machine_mm.map((mm, i) => mm - (checked.origin_mm[i] ?? 0)) : null;
}

// ---- hands ----

/** Fingers and the mouse's button that are down: they outlive the drawing that each of their moves brings. */
const down = new Map<number, Point>();

/** Pixels from the middle of the canvas. */
function placeOf(event: MouseEvent & { currentTarget: HTMLCanvasElement }): Point {
  const box = event.currentTarget.getBoundingClientRect();
  return { x: event.clientX - box.left - box.width / 2, y: event.clientY - box.top - box.height / 2 };
}

function gestures(kind: Kind): CanvasHTMLAttributes<HTMLCanvasElement> {
  const lift = (event: PointerEvent): void => void down.delete(event.pointerId);
  return {
    onPointerDown: (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      down.set(event.pointerId, placeOf(event));
    },
    onPointerMove: (event) => {
      const before = down.get(event.pointerId);
      if (!before) return;
      const after = placeOf(event);
      const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
      down.set(event.pointerId, after);
      const [dx, dy] = [after.x - before.x, after.y - before.y];
      const now = view.value;
      if (other) view.value = pinched(now, other, before, after);
      else if (kind === "top" || event.shiftKey) view.value = { ...now, shiftX: now.shiftX + dx, shiftY: now.shiftY + dy };
      else view.value = { ...now, turn: now.turn - dx * 0.01, tilt: Math.min(Math.PI / 2, Math.max(0.05, now.tilt + dy * 0.01)) };
    },
    onPointerUp: lift,
    onPointerCancel: lift,
    onLostPointerCapture: lift,
    onWheel: (event) => {
      event.preventDefault();
      view.value = zoomed(view.value, Math.exp(-event.deltaY * 0.0015), placeOf(event));
    },
    onDblClick: () => (view.value = kind === "top" ? TOP : SLANTED),
  };
}

/** Whether there is a path to see. */
export function hasPath(): boolean {
  return (preflight.result.value?.scene.points.length ?? 0) > 0;
}
