/** The outline of the loaded job, before its first cut: tool up, or the laser at low power. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { controller, move, noMotion, noPlace, preflight, standing } from "../app";
import { LASER_LIMIT_PCT, planFrame, type FramePlan, type FrameWish } from "../job/frame";
import { giveBack, modesOf } from "../link/modes";
import { settingNumber } from "../tables";
import { Button, Dialog, Field, Notice, StartStop } from "./parts";
import { t } from "../words";

const LASER_MODE = settingNumber("laser_mode");
const USUAL: FrameWish = { feed_mm_min: 2000, lift_mm: 5, power_pct: 0 };

export function FrameButton(): JSX.Element {
  const open = useSignal(false);
  const why = preflight.result.value ? noPlace.value || noMotion.value : t`The preflight has not finished.`;
  return (
    <>
      <Button why={why} title={t`Move once around the bounds of the job`} onClick={() => (open.value = true)} testId="frame">
        {t`Outline`}
      </Button>
      {open.value && <FrameDialog onClose={() => (open.value = false)} />}
    </>
  );
}

function FrameDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const hasLaser = Number(standing.value.settings.get(LASER_MODE) ?? 0) > 0;
  const wish = useSignal<FrameWish>(hasLaser ? { ...USUAL, lift_mm: 0, power_pct: 1 } : USUAL);
  const running = useSignal(false);
  const failed = useSignal("");
  const stopped = useSignal(false);
  const done = preflight.result.value;
  const planNow = (): FramePlan | null => (done ? planFrame(standing.value, done.report.min_mm, done.report.max_mm, wish.value) : null);
  const plan = planNow();
  const why = !plan ? t`The preflight has not finished.` : plan.kind === "refuse" ? plan.why : noMotion.value;
  const go = async (): Promise<void> => {
    [running.value, failed.value, stopped.value] = [true, "", false];
    const [stops, kept] = [controller.stops, modesOf(controller)];
    try {
      await controller.rest(); // it returns to where it is now, which the last report may not know
      const now = planNow();
      if (now?.kind !== "go") throw new Error(now?.why);
      for (const line of now.frame.lines) await move(line, stops);
      onClose();
    } catch (error) {
      failed.value = controller.stops !== stops ? t`Stopped by hand.` : error instanceof Error ? error.message : String(error);
      if (wish.value.power_pct > 0) await giveBack(controller, kept, ["M5"]).catch(() => {});
    }
    running.value = false;
  };
  const stop = (): void => {
    if (!running.peek() || stopped.peek()) return;
    stopped.value = controller.stopMotion();
  };
  const field = (name: keyof FrameWish, label: string, max: number): JSX.Element => (
    <Field label={label}>
      <input
        class="input mono"
        type="number"
        step="any"
        min={0}
        max={max}
        disabled={running.value}
        value={String(wish.value[name])}
        onInput={(event) => (wish.value = { ...wish.value, [name]: event.currentTarget.value.trim() === "" ? NaN : Number(event.currentTarget.value) })}
        data-test={`frame-${name}`}
      />
    </Field>
  );
  return (
    <Dialog
      title={t`Run the outline of the job`}
      onClose={() => (stop(), onClose())}
      actions={
        <StartStop
          start={{ text: t`Run the outline`, why: !running.value && why, onClick: () => void go(), testId: "frame-start" }}
          stop={{ text: t`Stop`, onClick: stop, testId: "frame-stop" }}
          runs={running.value}
          isStopping={stopped.value}
        >
          <Button disabled={running.value} onClick={onClose}>{t`Cancel`}</Button>
        </StartStop>
      }
    >
      <p class="soft">
        {t`The machine moves once around everything that the job does in X and Y, and returns. Look whether clamps are in the way and whether the work lies inside.`}
      </p>
      <div class="numbers">
        {field("feed_mm_min", t`Feed, mm/min`, 20_000)}
        {field("lift_mm", t`Lift Z first by, mm`, 200)}
        {hasLaser && field("power_pct", t`Laser, % (${LASER_LIMIT_PCT} at most)`, LASER_LIMIT_PCT)}
      </div>
      {plan?.kind === "go" && plan.frame.notes.map((note) => <Notice key={note} kind="warn" title={note} />)}
      {hasLaser && wish.value.power_pct > 0 && <Notice kind="warn" title={t`The laser is on during the outline: wear your goggles.`} />}
      {plan?.kind === "go" && (
        <details>
          <summary class="small">{t`Lines that it sends (${plan.frame.lines.length})`}</summary>
          <pre class="code" data-test="frame-lines">
            {plan.frame.lines.join("\n")}
          </pre>
        </details>
      )}
      {(failed.value || (why && !running.value)) && <Notice kind="bad" title={failed.value || why} />}
    </Dialog>
  );
}
