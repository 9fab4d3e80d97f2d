/** The laser lit at rest while a button is held, and the spindle that runs warm. Both end with the dialog, the window and the link. */
import { useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { controller, noMotion, standing } from "../app";
import { darkLines, fireLine, firePower_pct, longestFire_s, noFire, noStages, usualStages, type Stage } from "../link/fire";
import { Button, Dialog, Field, Notice } from "./parts";
import { t } from "../words";

const ANSWER_MS = 1000;

/** M5 is accepted in time, or else the controller is reset: everyone may do that. */
async function darken(modes: string): Promise<void> {
  const [off, ...rest] = darkLines(modes);
  const late = setTimeout(() => controller.reset(), ANSWER_MS);
  const answer = await controller.post(off!);
  clearTimeout(late);
  if (answer.kind === "error") controller.reset();
  for (const line of answer.kind === "ok" ? rest : []) await controller.post(line);
}

/** Call it when the window is hidden, loses the focus, or is left. */
function useAway(leave: () => void): void {
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

/** One beam at a time: what was lit is dark before the next one. */
class Beam {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private modes: string | null = null;

  constructor(private readonly tell: (lit: boolean, failed: string) => void) {}

  light(line: string, time_s: number): void {
    if (this.modes !== null) return;
    this.modes = controller.modes.peek();
    this.timer = setTimeout(() => this.end(), time_s * 1000);
    this.tell(true, "");
    void controller.post(line).then((answer) => {
      if (answer.kind === "ok") return;
      this.end();
      this.tell(false, answer.kind === "error" ? t`The controller has refused it: error ${answer.code}` : t`The connection was lost: the controller ends the beam.`);
    });
  }

  end(): void {
    const modes = this.modes;
    if (modes === null) return;
    clearTimeout(this.timer);
    this.modes = null;
    this.tell(false, "");
    if (controller.connected.peek()) void darken(modes);
  }
}

export function FireDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const settings = standing.value.settings;
  const wish = useSignal({ power_pct: Math.min(1, firePower_pct(settings)), time_s: 2 });
  const lit = useSignal(false);
  const failed = useSignal("");
  const beam = useSignal(new Beam((on, why) => ([lit.value, failed.value] = [on, why]))).value;
  useAway(() => beam.end());
  const busy = noMotion.value;
  useEffect(() => {
    if (busy) beam.end();
  }, [busy]);
  const why = noFire(settings, wish.value.power_pct, wish.value.time_s) || (controller.operates.value ? t`Not in a parked hold: the beam is dark there.` : busy);
  const begin = (): void => {
    if (!why) beam.light(fireLine(settings, wish.value.power_pct), wish.value.time_s);
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
    <Dialog title={t`Test the laser`} onClose={onClose}>
      <Notice kind="warn" title={t`Wear your goggles. The beam is on while you hold the button.`} />
      <div class="numbers">
        {field("power_pct", t`Power, % (${firePower_pct(settings)} at most)`, firePower_pct(settings))}
        {field("time_s", t`Time, s (${longestFire_s(settings)} at most)`, longestFire_s(settings))}
      </div>
      {why && !lit.value && <p class="small" data-test="fire-why">{why}</p>}
      {failed.value && <Notice kind="bad" title={failed.value} />}
      <div class="row">
        <button
          type="button"
          class={`button hold-down ${lit.value ? "danger" : "warn"}`}
          disabled={why !== "" && !lit.value}
          aria-pressed={lit.value}
          onPointerDown={(event) => {
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
    </Dialog>
  );
}

// ---- warm-up ----

/** The stages one after the other; the spindle stops at the end, with Stop, with the dialog and when the state changes. */
class WarmUp {
  private stopped = true;
  private wake: () => void = () => {};

  constructor(private readonly tell: (stage: number, failed: string) => void) {}

  async run(stages: readonly Stage[]): Promise<void> {
    this.stopped = false;
    let failed = "";
    for (const [i, { rpm, time_s }] of stages.entries()) {
      this.tell(i, "");
      const answer = await controller.post(`M3S${rpm}`);
      if (answer.kind !== "ok") failed = answer.kind === "error" ? t`The controller has refused it: error ${answer.code}` : t`The connection was lost, or the controller was reset.`;
      else if (!this.stopped) await this.wait(time_s);
      if (this.stopped || failed) break;
    }
    if (!failed && controller.state.peek() === "Idle") await controller.post("M5");
    this.stopped = true;
    this.tell(-1, failed);
  }

  /** A spindle that still runs up is stopped as a motion is. */
  stop(): void {
    if (this.stopped) return;
    this.stopped = true;
    this.wake();
    if (controller.state.peek() !== "Idle") controller.stopMotion();
  }

  private wait(time_s: number): Promise<void> {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, time_s * 1000);
      this.wake = () => (clearTimeout(timer), resolve());
    });
  }
}

export function WarmDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const settings = standing.value.settings;
  const stages = useSignal<readonly Stage[]>(usualStages(settings));
  const at = useSignal(-1);
  const failed = useSignal("");
  const warm = useSignal(new WarmUp((stage, why) => ([at.value, failed.value] = [stage, why]))).value;
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
    <Dialog title={t`Warm up the spindle`} onClose={onClose}>
      <p class="soft">{t`The spindle turns forward (M3) at each speed, then stops. Nothing else moves. Keep clear of the tool.`}</p>
      {stages.value.map((_, i) => (
        <div key={i} class="numbers" aria-current={i === at.value ? "step" : undefined}>
          {number(i, "rpm", t`${i + 1}. Speed, rpm${i === at.value ? t` (now)` : ""}`)}
          {number(i, "time_s", t`Time, s`)}
        </div>
      ))}
      {(failed.value || (why && !runs)) && <Notice kind="bad" title={failed.value || why} />}
      <div class="row">
        {runs ? (
          <Button kind="danger" icon="stop" onClick={() => warm.stop()} testId="warm-stop">
            {t`Stop`}
          </Button>
        ) : (
          <Button kind="primary" icon="play" why={why} onClick={() => void warm.run(stages.value)} testId="warm-start">
            {t`Start the spindle`}
          </Button>
        )}
        {!runs && <Button onClick={onClose}>{t`Close`}</Button>}
      </div>
    </Dialog>
  );
}
