/** The laser lit at rest while a button is held, and the spindle that runs warm. Both end with the dialog, the window and the link. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { controller, noMotion, standing } from "../app";
import { Beam } from "../link/beam";
import { fireLine, firePower_pct, longestFire_s, noFire, noStages, usualStages, type Stage } from "../link/fire";
import { WarmUp } from "../link/warmup";
import { Button, Dialog, Field, Notice, StartStop } from "./parts";
import { t } from "../words";

/** Call it when the window is hidden, loses the focus, or is left. */
export function useAway(leave: () => void): void {
  useEffect(() => {
    const hidden = (): void => void (document.hidden && leave());
    window.addEventListener("blur", leave);
    window.addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", hidden);
    return () => {
      window.removeEventListener("blur", leave);
      window.removeEventListener("pagehide", leave);
      document.removeEventListener("visibilitychange", hidden);
      leave();
    };
  }, []);
}

export function FireDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const settings = standing.value.settings;
  const wish = useSignal({ power_pct: Math.min(1, firePower_pct(settings)), time_s: 2 });
  const lit = useSignal(false);
  const failed = useSignal("");
  const beam = useSignal(new Beam(controller, (on, why) => ([lit.value, failed.value] = [on, why]))).value;
  useAway(() => beam.end());
  const busy = noMotion.value;
  useEffect(() => {
    if (busy) beam.end();
  }, [busy]);
  const why = noFire(settings, wish.value.power_pct, wish.value.time_s) || (controller.operates.value ? t`Not in a parked hold: the beam is dark there.` : busy);
  const begin = (): void => {
    if (!why) void beam.light(fireLine(settings, wish.value.power_pct), wish.value.time_s);
  };
  const field = (name: "power_pct" | "time_s", label: string, max: number): JSX.Element => (
    <Field label={label}>
      <input
        class="input mono"
        type="number"
        step="any"
        min={0}
        max={max}
        value={String(wish.value[name])}
        onInput={(event) => (wish.value = { ...wish.value, [name]: Number(event.currentTarget.value.trim() || NaN) })}
        data-test={`fire-${name}`}
      />
    </Field>
  );
  return (
    <Dialog
      title={t`Test the laser`}
      onClose={onClose}
      actions={
        <div class="row">
          <button
            type="button"
            class={`button hold-down ${lit.value ? "danger" : "warn"}`}
            disabled={why !== "" && !lit.value}
            aria-pressed={lit.value}
            aria-label={t`Hold to light`}
            data-machine="starts"
            onPointerDown={(event) => {
              if (event.button !== 0) return;
              event.currentTarget.setPointerCapture(event.pointerId);
              begin();
            }}
            onPointerUp={() => beam.end()}
            onPointerCancel={() => beam.end()}
            onLostPointerCapture={() => beam.end()}
            onContextMenu={(event) => event.preventDefault()}
            onKeyDown={(event) => {
              if ((event.key === "Enter" || event.key === " ") && !event.repeat) begin();
            }}
            onKeyUp={() => beam.end()}
            onBlur={() => beam.end()}
            data-test="fire-hold"
          >
            {lit.value ? t`The laser is on` : t`Hold to light`}
          </button>
          <Button onClick={onClose}>{t`Close`}</Button>
        </div>
      }
    >
      <Notice kind="warn" title={t`Wear your goggles. The beam is on while you hold the button.`} />
      <div class="numbers">
        {field("power_pct", t`Power, % (${firePower_pct(settings)} at most)`, firePower_pct(settings))}
        {field("time_s", t`Time, s (${longestFire_s(settings)} at most)`, longestFire_s(settings))}
      </div>
      {why && !lit.value && <p class="small" data-test="fire-why">{why}</p>}
      {failed.value && <Notice kind="bad" title={failed.value} />}
    </Dialog>
  );
}

// ---- warm-up ----

export function WarmDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const settings = standing.value.settings;
  const stages = useSignal<readonly Stage[]>(usualStages(settings));
  const at = useSignal(-1);
  const failed = useSignal("");
  const warm = useSignal(new WarmUp(controller, (stage, why) => ([at.value, failed.value] = [stage, why]))).value;
  useEffect(() => () => warm.stop(), []);
  const state = controller.state.value;
  useEffect(() => {
    if (at.peek() >= 0 && !["Idle", "Run"].includes(state)) warm.stop();
  }, [state]);
  const runs = at.value >= 0;
  const why = noStages(settings, stages.value) || (controller.operates.value ? t`Not in a parked hold: a job waits there.` : noMotion.value);
  const change = (i: number, part: Partial<Stage>): void => void (stages.value = stages.value.map((stage, n) => (n === i ? { ...stage, ...part } : stage)));
  const number = (i: number, name: keyof Stage, label: string): JSX.Element => (
    <Field label={label}>
      <input
        class="input mono"
        type="number"
        min={0}
        disabled={runs}
        value={String(stages.value[i]![name])}
        onInput={(event) => change(i, { [name]: Number(event.currentTarget.value.trim() || NaN) })}
        data-test={`warm-${name}-${i}`}
      />
    </Field>
  );
  return (
    <Dialog
      title={t`Warm up the spindle`}
      onClose={onClose}
      actions={
        <StartStop
          start={{ text: t`Start the spindle`, why: !runs && why, onClick: () => void warm.run(stages.value), testId: "warm-start" }}
          stop={{ text: t`Stop`, onClick: () => warm.stop(), testId: "warm-stop" }}
          runs={runs}
        >
          <Button disabled={runs} onClick={onClose}>{t`Close`}</Button>
        </StartStop>
      }
    >
      <p class="soft">{t`The spindle turns forward (M3) at each speed, then stops. Nothing else moves. Keep clear of the tool.`}</p>
      {stages.value.map((_, i) => (
        <div key={i} class="numbers" aria-current={i === at.value ? "step" : undefined}>
          {number(i, "rpm", t`${i + 1}. Speed, rpm${i === at.value ? t` (now)` : ""}`)}
          {number(i, "time_s", t`Time, s`)}
        </div>
      ))}
      {(failed.value || (why && !runs)) && <Notice kind="bad" title={failed.value || why} />}
    </Dialog>
  );
}
