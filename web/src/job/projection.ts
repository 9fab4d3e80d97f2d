/** From millimetres to a picture: a parallel projection that turns, zooms and shifts. Pure. */

import { TABLES } from "../tables";

export interface View {
  /** About Z, and up from the horizon, radians. Straight down: 0 and pi/2. */
  turn: number;
  tilt: number;
  /** Times what just fits. */
  zoom: number;
  /** Pixels. */
  shiftX: number;
  shiftY: number;
}

export interface Box {
  min: [number, number, number];
  max: [number, number, number];
}

/** Pixels from the middle of the picture. */
export interface Point {
  x: number;
  y: number;
}

const ZOOM_MIN = 0.3;
const ZOOM_MAX = 60;

/** Larger by this factor; what is seen at this place stays there. */
export function zoomed(view: View, factor: number, at: Point): View {
  const zoom = Math.min(ZOOM_MAX, Math.max(ZOOM_MIN, view.zoom * factor));
  const by = zoom / view.zoom;
  return { ...view, zoom, shiftX: at.x - (at.x - view.shiftX) * by, shiftY: at.y - (at.y - view.shiftY) * by };
}

/** One of two fingers has moved: what is under their middle goes along with it, as much larger as they are further apart. */
export function pinched(view: View, still: Point, before: Point, after: Point): View {
  const apart = (finger: Point): number => Math.max(1, Math.hypot(finger.x - still.x, finger.y - still.y));
  const middle = (finger: Point): Point => ({ x: (finger.x + still.x) / 2, y: (finger.y + still.y) / 2 });
  const [from, to] = [middle(before), middle(after)];
  const larger = zoomed(view, apart(after) / apart(before), from);
  return { ...larger, shiftX: larger.shiftX + to.x - from.x, shiftY: larger.shiftY + to.y - from.y };
}

export const TOP: View = { turn: 0, tilt: Math.PI / 2, zoom: 1, shiftX: 0, shiftY: 0 };
export const SLANTED: View = { ...TABLES.look.isometric, zoom: 1, shiftX: 0, shiftY: 0 };

const MARGIN = 0.86;

export type Project = (x: number, y: number, z: number) => [number, number];

/** Projects the box, as large as fits into width x height. */
export function projection(view: View, box: Box, width: number, height: number): Project {
  const [sin, cos] = [Math.sin(view.turn), Math.cos(view.turn)];
  const [up, flat] = [Math.sin(view.tilt), Math.cos(view.tilt)];
  const middle = box.min.map((low, i) => (low + box.max[i]!) / 2) as [number, number, number];
  const raw = (x: number, y: number, z: number): [number, number] => {
    const [dx, dy, dz] = [x - middle[0], y - middle[1], z - middle[2]];
    return [dx * cos - dy * sin, -((dx * sin + dy * cos) * up + dz * flat)];
  };
  let [wide, high] = [1e-6, 1e-6];
  for (const x of [box.min[0], box.max[0]])
    for (const y of [box.min[1], box.max[1]])
      for (const z of [box.min[2], box.max[2]]) {
        const [u, v] = raw(x, y, z);
        wide = Math.max(wide, Math.abs(u) * 2);
        high = Math.max(high, Math.abs(v) * 2);
      }
  const scale = view.zoom * MARGIN * Math.min(width / wide, height / high);
  return (x, y, z) => {
    const [u, v] = raw(x, y, z);
    return [width / 2 + view.shiftX + u * scale, height / 2 + view.shiftY + v * scale];
  };
}

/** The lines of a grid that a reader can count: 1, 2 or 5 times a power of ten apart, about `count` of them. */
export function gridStep(span: number, count: number): number {
  const rough = Math.max(span, 1e-3) / count;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * ten >= rough)!;
  return step * ten;
}

/** The box, widened in X and Y to whole lines of a grid of about `count` lines. What is beyond a line by less than a hundredth
 * of a cell, as rounding is, opens no new one. */
export function gridOf(box: Box, count: number): { step: number; box: Box } {
  const step = gridStep(Math.max(box.max[0] - box.min[0], box.max[1] - box.min[1]), count);
  const low = (value: number): number => Math.floor(value / step + 0.01) * step;
  const high = (value: number): number => Math.ceil(value / step - 0.01) * step;
  const [min, max] = [box.min, box.max];
  return { step, box: { min: [low(min[0]), low(min[1]), min[2]], max: [high(max[0]), high(max[1]), max[2]] } };
}
