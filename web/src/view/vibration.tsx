/** Input shapers from measured waves; the form comes when it is opened. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { later } from "./later";
import { Button, Card } from "./parts";
import type { OnUse } from "./waves";
import { t } from "../words";

const Measured = later(async () => (await import("./waves")).Measured);
const open = signal(false);

export function VibrationCard({ onUse }: { onUse: OnUse }): JSX.Element {
  const toggle = (
    <Button size="small" pressed={open.value} onClick={() => (open.value = !open.value)} testId="vibration-open">
      {t`Measured waves`}
    </Button>
  );
  return (
    <Card title={t`Vibration`} tools={toggle}>
      {open.value ? <Measured onUse={onUse} /> : <p class="small soft">{t`Waves next to corners? Measure them, and choose an input shaper.`}</p>}
    </Card>
  );
}
