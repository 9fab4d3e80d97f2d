/** The picture of a path on a canvas: grid, extent, rapids, cuts coloured by their speed, ends, tool. */
import { gridOf, projection, type Box, type Project, type View } from "../job/projection";
import { AT_REST, type Engraving } from "../job/engraving";
import { cutWidth, levelColours, RAPID, type Scene } from "../job/scene";
import { TABLES } from "../tables";

const LOOK = TABLES.look;
const GRID_LINES = 10;
/** Of a number at the left of the grid, and where it is at the edge, px. */
const LABEL_WIDTH = 26;
const LABEL_EDGE = 3;
const MARK_PX = 5;
const PLUNGE_PX = 1.6;
const EXTENT_DASHES = [1, 2.5];
/** Corners of a box, three bits each, and the pairs that differ in one of them. */
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((a) => [1, 2, 4].filter((bit) => !(a & bit)).map((bit) => [a, a | bit] as const));

export interface Ink {
  speeds: string[];
  energies: string[];
  rapid: string;
  extent: string;
  done: string;
  grid: string;
  text: string;
  tool: string;
}

/** What is drawn: the part up to `seconds` is done; tool null: not connected. */
export interface Picture {
  scene: Scene;
  box: Box;
  view: View;
  seconds: number;
  tool: readonly number[] | null;
}

export function inkOf(theme: "light" | "dark"): Ink {
  const style = getComputedStyle(document.documentElement);
  const read = (name: string): string => style.getPropertyValue(name).trim();
  return {
    speeds: levelColours(theme === "dark", "speed"),
    energies: levelColours(theme === "dark", "engraving"),
    rapid: LOOK.rapid[theme],
    extent: LOOK.extent[theme],
    done: read("--path-done"),
    grid: read("--path-grid"),
    text: read("--ink-faint"),
    tool: read("--accent"),
  };
}

/** What stays while the tool moves, in canvases of their own: only what has been done since is drawn again. */
interface Layers {
  key: unknown[];
  still: CanvasRenderingContext2D;
  done: CanvasRenderingContext2D;
  project: Project;
  /** How far the job is in `done`: seconds, and how many points, pieces and plunges. */
  seconds: number;
  points: number;
  pieces: number;
  plunges: number;
}

const layersOf = new WeakMap<HTMLCanvasElement, Layers>();

export function draw(canvas: HTMLCanvasElement, picture: Picture, ink: Ink): void {
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const context = canvas.getContext("2d");
  if (!context || width === 0) return;
  const key = [picture.scene, picture.view, ink.text, width, height, scale, ...picture.box.min, ...picture.box.max];
  let layers = layersOf.get(canvas);
  if (!layers || layers.key.some((value, i) => value !== key[i])) {
    canvas.width = width * scale;
    canvas.height = height * scale;
    layers = drawStill(picture, ink, width, height, scale, key);
    layersOf.set(canvas, layers);
  }
  if (picture.seconds < layers.seconds) forgetDone(layers, width, height);
  drawDone(layers, picture, ink);
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.drawImage(layers.still.canvas, 0, 0);
  context.drawImage(layers.done.canvas, 0, 0);
  context.setTransform(scale, 0, 0, scale, 0, 0);
  drawEnds(context, picture.scene.points, layers.project);
  const { tool } = picture;
  if (tool) drawMark(context, layers.project(tool[0] ?? 0, tool[1] ?? 0, tool[2] ?? 0), ink.tool, "round", MARK_PX + 1);
}

function layer(width: number, height: number, scale: number): CanvasRenderingContext2D {
  const canvas = document.createElement("canvas");
  canvas.width = width * scale;
  canvas.height = height * scale;
  const context = canvas.getContext("2d")!;
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.lineJoin = context.lineCap = "round";
  return context;
}

function drawStill(picture: Picture, ink: Ink, width: number, height: number, scale: number, key: unknown[]): Layers {
  const [still, done] = [layer(width, height, scale), layer(width, height, scale)];
  const grid = gridOf(picture.box, GRID_LINES);
  const project = projection(picture.view, grid.box, width, height);
  drawGrid(still, grid.step, grid.box, project, ink);
  drawExtent(still, picture.box, project, ink);
  drawPath(still, picture, project, ink);
  const { engraving } = picture.scene;
  if (engraving) drawEngraving(still, engraving, picture, project, ink);
  else if (isFromAbove(picture.view)) drawPlunges(still, picture.scene, 0, picture.scene.plunges.length, project, ink);
  return { key, still, done, project, seconds: 0, points: 1, pieces: 0, plunges: 0 };
}

/** From above a hole is a point. */
function isFromAbove(view: View): boolean {
  return view.tilt >= Math.PI / 2;
}

function forgetDone(layers: Layers, width: number, height: number): void {
  layers.done.clearRect(0, 0, width, height);
  Object.assign(layers, { seconds: 0, points: 1, pieces: 0, plunges: 0 });
}

/** What came since the last time. */
function drawDone(layers: Layers, { scene, view, box, seconds }: Picture, ink: Ink): void {
  const { done, project } = layers;
  const { points, levels, engraving, plunges } = scene;
  const way = new Path2D();
  const at = (i: number): [number, number] => project(points[i * 3]!, points[i * 3 + 1]!, points[i * 3 + 2]!);
  for (let isFirst = true; layers.points < levels.length && scene.seconds[layers.points]! <= seconds; layers.points++) {
    if (engraving && levels[layers.points] !== RAPID) {
      isFirst = true;
      continue;
    }
    if (isFirst) way.moveTo(...at(layers.points - 1));
    way.lineTo(...at(layers.points));
    isFirst = false;
  }
  stroke(done, way, ink.done, engraving ? LOOK.rapid.width : cutWidth(levels.length));
  if (engraving) burnDone(layers, engraving, box, seconds, ink);
  layers.seconds = seconds;
  if (engraving || !isFromAbove(view)) return;
  const from = layers.plunges;
  while (layers.plunges < plunges.length && scene.seconds[plunges[layers.plunges]!]! <= seconds) layers.plunges++;
  drawPlunges(done, scene, from, layers.plunges, project, ink, ink.done);
}

function burnDone(layers: Layers, engraving: Engraving, box: Box, seconds: number, ink: Ink): void {
  const burnt = new Path2D();
  for (; layers.pieces < engraving.levels.length && engraving.seconds[layers.pieces]! <= seconds; layers.pieces++)
    if (engraving.levels[layers.pieces] !== AT_REST) addPiece(burnt, engraving, layers.pieces, layers.project);
  const isDense = engraving.levels.length > LOOK.engraving.dense;
  layers.done.lineCap = isDense ? "square" : "round";
  stroke(layers.done, burnt, ink.tool, isDense ? denseWidth(engraving, box, layers.project) : cutWidth(engraving.levels.length));
  layers.done.lineCap = "round";
}

function addPiece(line: Path2D, { ends }: Engraving, i: number, project: Project): void {
  line.moveTo(...project(ends[i * 6]!, ends[i * 6 + 1]!, ends[i * 6 + 2]!));
  line.lineTo(...project(ends[i * 6 + 3]!, ends[i * 6 + 4]!, ends[i * 6 + 5]!));
}

function drawGrid(context: CanvasRenderingContext2D, step: number, box: Box, project: Project, ink: Ink): void {
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

function drawExtent(context: CanvasRenderingContext2D, box: Box, project: Project, ink: Ink): void {
  const corner = (bits: number): [number, number] =>
    project(...(([0, 1, 2] as const).map((n) => (bits & (1 << n) ? box.max[n] : box.min[n])) as [number, number, number]));
  context.strokeStyle = ink.extent;
  context.lineWidth = LOOK.extent.width;
  context.setLineDash(EXTENT_DASHES);
  context.beginPath();
  for (const [a, b] of EDGES) {
    context.moveTo(...corner(a));
    context.lineTo(...corner(b));
  }
  context.stroke();
  context.setLineDash([]);
}

/** All segments of one colour are one stroke: rapids, and cuts by their level. */
function drawPath(context: CanvasRenderingContext2D, { scene }: Picture, project: Project, ink: Ink): void {
  const { points, levels } = scene;
  const rapids = new Path2D();
  const cuts = ink.speeds.map(() => new Path2D());
  let before: Path2D | null = null;
  for (let i = 1; i < levels.length; i++) {
    if (scene.engraving && levels[i] !== RAPID) {
      before = null;
      continue;
    }
    const line = levels[i] === RAPID ? rapids : cuts[levels[i]!]!;
    if (line !== before) line.moveTo(...project(points[i * 3 - 3]!, points[i * 3 - 2]!, points[i * 3 - 1]!));
    line.lineTo(...project(points[i * 3]!, points[i * 3 + 1]!, points[i * 3 + 2]!));
    before = line;
  }
  context.setLineDash(LOOK.rapid.dashes);
  stroke(context, rapids, ink.rapid, LOOK.rapid.width);
  context.setLineDash([]);
  const width = cutWidth(levels.length);
  cuts.forEach((line, level) => stroke(context, line, ink.speeds[level]!, width));
}

function stroke(context: CanvasRenderingContext2D, line: Path2D, colour: string, width: number): void {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke(line);
}

/** From pale to dark, so that the dark is on top; then crosses where the beam burns at rest. */
function drawEngraving(context: CanvasRenderingContext2D, engraving: Engraving, { box }: Picture, project: Project, ink: Ink): void {
  const { ends, levels } = engraving;
  const rests = new Path2D();
  const burnt = ink.energies.map(() => new Path2D());
  for (let i = 0; i < levels.length; i++) {
    if (levels[i] !== AT_REST) {
      addPiece(burnt[levels[i]!]!, engraving, i, project);
      continue;
    }
    const [u, v] = project(ends[i * 6]!, ends[i * 6 + 1]!, ends[i * 6 + 2]!);
    rests.moveTo(u - MARK_PX, v - MARK_PX);
    rests.lineTo(u + MARK_PX, v + MARK_PX);
    rests.moveTo(u - MARK_PX, v + MARK_PX);
    rests.lineTo(u + MARK_PX, v - MARK_PX);
  }
  const isDense = levels.length > LOOK.engraving.dense;
  const width = isDense ? denseWidth(engraving, box, project) : cutWidth(levels.length);
  if (isDense) context.lineCap = "square"; // neighbours of different levels have no seam
  burnt.forEach((line, level) => stroke(context, line, ink.energies[level]!, width));
  context.lineCap = "round";
  stroke(context, rests, LOOK.end, 1.5);
}

/** Dense lines are as wide as they are apart: hatching becomes an area. */
function denseWidth({ length_mm }: Engraving, { min, max }: Box, project: Project): number {
  const [a, b] = [project(...min), project(min[0] + 1, min[1], min[2])];
  const px_per_mm = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const apart_mm = ((max[0] - min[0]) * (max[1] - min[1])) / length_mm;
  const [least, most] = LOOK.engraving.widths as [number, number];
  return Math.min(most, Math.max(least, LOOK.engraving.cover * apart_mm * px_per_mm));
}

/** Points from one number to before another, in the colour of their speed or in this one. */
function drawPlunges(
  context: CanvasRenderingContext2D,
  { points, levels, plunges }: Scene,
  from: number,
  to: number,
  project: Project,
  ink: Ink,
  colour?: string,
): void {
  for (const i of plunges.subarray(from, to)) {
    const [u, v] = project(points[i * 3]!, points[i * 3 + 1]!, points[i * 3 + 2]!);
    context.fillStyle = colour ?? ink.speeds[levels[i]!]!;
    context.beginPath();
    context.arc(u, v, PLUNGE_PX, 0, 2 * Math.PI);
    context.fill();
  }
}

function drawEnds(context: CanvasRenderingContext2D, points: Float32Array, project: Project): void {
  if (points.length === 0) return;
  const at = (i: number): [number, number] => project(points[i]!, points[i + 1]!, points[i + 2]!);
  drawMark(context, at(points.length - 3), LOOK.end, "square", MARK_PX);
  drawMark(context, at(0), LOOK.start, "round", MARK_PX);
}

function drawMark(context: CanvasRenderingContext2D, [u, v]: [number, number], colour: string, shape: "round" | "square", radius: number): void {
  context.fillStyle = colour;
  context.strokeStyle = "#ffffff";
  context.lineWidth = 1.5;
  context.beginPath();
  if (shape === "round") context.arc(u, v, radius, 0, 2 * Math.PI);
  else context.rect(u - radius, v - radius, 2 * radius, 2 * radius);
  context.fill();
  context.stroke();
}
