/** What a probing cycle does, as a picture: the plate from the side, all others from above. The text next to it has the same. */
import type { ComponentChildren, JSX } from "preact";
import type { Cycle, ProbeValues } from "../link/probing";

export function ProbePicture({ cycle, values }: { cycle: Cycle; values: ProbeValues }): JSX.Element {
  const { side, edge } = values;
  const mirrored = cycle === "corner" ? `scale(${-side.X} ${-side.Y})` : "";
  const turned = cycle === "edge" || cycle === "rotation" ? (edge === "X" ? `scale(${-side.X} 1)` : `rotate(${side.Y < 0 ? -90 : 90})`) : "";
  return (
    <svg class="probe-picture" viewBox="-60 -60 120 120" aria-hidden="true">
      <g transform={mirrored || turned || undefined}>{DRAWN[cycle]}</g>
    </svg>
  );
}

/** From, to: with a head at its end. */
function Arrow({ from: [x0, y0], to: [x1, y1] }: { from: [number, number]; to: [number, number] }): JSX.Element {
  const turn = (Math.atan2(y1 - y0, x1 - x0) * 180) / Math.PI;
  return (
    <g class="arrow">
      <path d={`M${x0} ${y0}L${x1} ${y1}`} />
      <path d="M-6 -4L0 0L-6 4" transform={`translate(${x1} ${y1}) rotate(${turn})`} />
    </g>
  );
}

function Zero({ at: [x, y] }: { at: [number, number] }): JSX.Element {
  return <path class="zero" d={`M${x - 7} ${y}h14M${x} ${y - 7}v14`} />;
}

const four = (near: number, far: number): ComponentChildren =>
  ([[1, 0], [-1, 0], [0, 1], [0, -1]] as const).map(([x, y]) => <Arrow key={`${x}${y}`} from={[x * near, y * near]} to={[x * far, y * far]} />);

/** With the corner of the work at the lower left: y is down here. */
const DRAWN: Readonly<Record<Cycle, JSX.Element>> = {
  plate: (
    <>
      <rect class="work" x={-50} y={18} width={100} height={40} />
      <rect class="plate" x={-24} y={6} width={48} height={12} />
      <path class="tool" d="M-7 -52h14v34h-14z" />
      <Arrow from={[0, -16]} to={[0, 3]} />
    </>
  ),
  corner: (
    <>
      <path class="work" d="M-20 20V-55H55V20z" />
      <path class="plate" d="M-26 26V-8H8V26z" />
      <circle class="tool" cx={-46} cy={8} r={8} />
      <circle class="tool" cx={-8} cy={46} r={8} />
      <Arrow from={[-38, 8]} to={[-27, 8]} />
      <Arrow from={[-8, 38]} to={[-8, 27]} />
      <Zero at={[-20, 20]} />
    </>
  ),
  hole: (
    <>
      <rect class="work" x={-55} y={-55} width={110} height={110} />
      <circle class="hollow" r={42} />
      <circle class="tool" r={8} />
      {four(12, 38)}
      <Zero at={[0, 0]} />
    </>
  ),
  boss: (
    <>
      <circle class="work" r={26} />
      {four(55, 29)}
      <Zero at={[0, 0]} />
    </>
  ),
  rotation: (
    <>
      <path class="work" d="M-4 -50L55 -58V58L8 50z" />
      <circle class="tool" cx={-38} cy={34} r={8} />
      <circle class="tool" cx={-38} cy={-34} r={8} />
      <Arrow from={[-30, 34]} to={[3, 34]} />
      <Arrow from={[-30, -34]} to={[-6, -34]} />
      <Arrow from={[-38, 24]} to={[-38, -22]} />
    </>
  ),
  length: (
    <>
      <rect class="work" x={-50} y={42} width={100} height={16} />
      <rect class="plate" x={-16} y={18} width={32} height={24} />
      <path class="tool" d="M-34 -52h14v24h-14zM-7 -52h14v46h-14z" />
      <Arrow from={[0, -4]} to={[0, 15]} />
      <path class="zero" d="M-40 -6h80M-40 -28h26" />
    </>
  ),
  edge: (
    <>
      <rect class="work" x={0} y={-50} width={55} height={100} />
      <circle class="tool" cx={-36} cy={0} r={8} />
      <Arrow from={[-28, 0]} to={[-3, 0]} />
      <path class="zero" d="M0 -56V56" />
    </>
  ),
};
