/** The probing cycles; their dialogs come with the first one that is opened. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { noMotion } from "../app";
import type { Cycle } from "../link/probing";
import { later } from "./later";
import { Button, Card } from "./parts";
import { msg, t, tr } from "../words";

const ProbeDialog = later(async () => (await import("./probedialog")).ProbeDialog);

const CYCLES: readonly (readonly [Cycle, string])[] = [
  ["plate", msg`Z plate`],
  ["corner", msg`Corner`],
  ["hole", msg`Centre of a hole`],
  ["boss", msg`Centre of a boss`],
  ["edge", msg`Edge`],
  ["rotation", msg`Rotation`],
  ["length", msg`Tool length`],
];

export function ProbeCard(): JSX.Element {
  const open = useSignal<(typeof CYCLES)[number] | null>(null);
  return (
    <Card title={t`Probe`}>
      <div class="row">
        {CYCLES.map((entry) => (
          <Button key={entry[0]} why={noMotion.value} onClick={() => (open.value = entry)} testId={`probe-${entry[0]}`}>
            {tr(entry[1])}
          </Button>
        ))}
      </div>
      {open.value && <ProbeDialog cycle={open.value[0]} title={tr(open.value[1])} onClose={() => (open.value = null)} />}
    </Card>
  );
}
