/** Measured waves to the settings of an input shaper. */
import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";
import { controller, noHoming } from "../app";
import { assignments, delay_s, impulses, leaves, measured, recommended, residual, rounding_mm, SHAPERS, SPREAD, type Mode, type Shaper } from "../tune/shapers";
import { AXES, settingNumber } from "../tables";
import { Button, Field, Segments } from "./parts";
import { msg, t, tr } from "../words";

const FIELDS = [
  { name: "feed_mm_min", label: msg`Feed, mm/min` },
  { name: "waves", label: msg`Waves` },
  { name: "distance_mm", label: msg`Their distance, mm` },
  { name: "first", label: msg`Height of the first wave` },
  { name: "last", label: msg`Height of the last wave` },
] as const;

type FieldName = (typeof FIELDS)[number]["name"];

const axis = signal(0);
const typed = signal<Readonly<Record<FieldName, string>>>({ feed_mm_min: "", waves: "", distance_mm: "", first: "", last: "" });
/** null: the recommended one. */
const chosen = signal<Shaper | null>(null);

const mode = computed(() => {
  const number = (name: FieldName): number => (typed.value[name].trim() === "" ? NaN : Number(typed.value[name].replace(",", ".")));
  return measured({ feed_mm_min: number("feed_mm_min"), waves: number("waves"), distance_mm: number("distance_mm"), first: number("first"), last: number("last") });
});

export type OnUse = (values: ReadonlyMap<number, string>) => void;

export function Measured({ onUse }: { onUse: OnUse }): JSX.Element {
  const found = mode.value;
  const axes = [...AXES.slice(0, controller.axisCount.value || 3)];
  return (
    <>
      <p class="small soft">
        {t`Run the pattern of`}{" "}<code>{t`wificnc tune pattern`}</code>{t`, and measure the waves next to a line: their number from crest to crest, their distance, and if you can the heights of the first and the last one.`}
      </p>
      <div class="row">
        <Segments label={t`Axis that vibrates`} value={axis.value} options={axes.map((text, value) => ({ value, text }))} onChange={(value) => (axis.value = value)} />
      </div>
      <div class="row">
        {FIELDS.map(({ name, label }) => (
          <Field key={name} label={tr(label)}>
            <input
              class="input short mono"
              inputMode="decimal"
              value={typed.value[name]}
              data-test={`vibration-${name}`}
              onInput={(event) => (typed.value = { ...typed.value, [name]: event.currentTarget.value })}
            />
          </Field>
        ))}
      </div>
      {typeof found === "string" ? (
        <p class="soft" role="status" data-test="vibration-missing">
          {found}
        </p>
      ) : (
        <Found mode={found} onUse={onUse} />
      )}
    </>
  );
}

function Found({ mode, onUse }: { mode: Mode; onUse: OnUse }): JSX.Element {
  const shaper = chosen.value ?? recommended(mode);
  const values = assignments(axis.value, shaper, mode);
  const unknown = controller.settings.value.has(settingNumber("shaper") + axis.value) ? "" : t`This controller does not have input shapers.`;
  return (
    <>
      <p role="status" data-test="vibration-found">
        <strong>
          {t`${mode.hz.toFixed(2)} Hz, damping ${mode.damping.toFixed(3)}`}
        </strong>
      </p>
      <ShaperTable mode={mode} shaper={shaper} />
      <Curves mode={mode} />
      <div class="row">
        <Button kind="primary" why={noHoming.value || unknown} onClick={() => onUse(values)} testId="vibration-use">
          {t`Use ${shaper.name}`}
        </Button>
        <code data-test="vibration-settings">{[...values].map(([number, text]) => `$${number}=${text}`).join(" ")}</code>
      </div>
    </>
  );
}

/** With the acceleration of the axis, where the controller has reported it. */
function ShaperTable({ mode, shaper: used }: { mode: Mode; shaper: Shaper }): JSX.Element {
  const acceleration = Number(controller.settings.value.get(settingNumber("acceleration_mm_s2") + axis.value));
  const best = recommended(mode);
  const percent = 100 * SPREAD;
  return (
    <div class="scroll">
      <table>
        <thead>
          <tr>
            <th>{t`Shaper`}</th>
            <th class="number">{t`leaves`}</th>
            <th class="number">±{percent} %</th>
            <th class="number hide-narrow">{t`delay`}</th>
            {acceleration > 0 && <th class="number hide-narrow">{t`rounding`}</th>}
          </tr>
        </thead>
        <tbody>
          {SHAPERS.map((shaper) => {
            const { here, off } = leaves(shaper, mode);
            const shape = impulses(shaper, mode);
            return (
              <tr key={shaper.value}>
                <td>
                  <label class="check">
                    <input type="radio" name="shaper" checked={shaper === used} onChange={() => (chosen.value = shaper)} />
                    <span class={`swatch curve-${shaper.value}`} aria-hidden="true" />
                    {shaper.name.replace(" ", "\u00a0")}
                    {shaper === best && <span class="small soft hide-narrow">{t`recommended`}</span>}
                  </label>
                </td>
                <td class="number mono">{(100 * here).toFixed(1)}&nbsp;%</td>
                <td class="number mono">{(100 * off).toFixed(1)}&nbsp;%</td>
                <td class="number mono hide-narrow">{t`${(1e3 * delay_s(shape)).toFixed(1)} ms`}</td>
                {acceleration > 0 && <td class="number mono hide-narrow">{(1e3 * rounding_mm(shape, acceleration)).toFixed(1)}&nbsp;µm</td>}
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

const WIDTH = 520;
const HEIGHT = 190;
const LEFT = 38;
const BOTTOM = 22;
const POINTS = 160;
/** Times the measured frequency. */
const FROM = 0.5;
const TO = 1.5;

/** What each shaper leaves if the frequency is another one. */
function Curves({ mode }: { mode: Mode }): JSX.Element {
  const x = (part: number): number => LEFT + ((part - FROM) / (TO - FROM)) * (WIDTH - LEFT - 4);
  const y = (left: number): number => 6 + (1 - left) * (HEIGHT - BOTTOM - 6);
  const parts = Array.from({ length: POINTS + 1 }, (_, i) => FROM + ((TO - FROM) * i) / POINTS);
  const path = (shaper: Shaper): string => {
    const shape = impulses(shaper, mode);
    return parts.map((part, i) => `${i ? "L" : "M"}${x(part).toFixed(1)} ${y(residual(shape, { ...mode, hz: mode.hz * part })).toFixed(1)}`).join("");
  };
  return (
    <svg class="curves" viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={t`Vibration that each shaper leaves, over the frequency`}>
      {[0, 0.25, 0.5, 0.75, 1].map((left) => (
        <g key={left}>
          <line class="grid" x1={LEFT} x2={WIDTH} y1={y(left)} y2={y(left)} />
          <text x={LEFT - 5} y={y(left) + 4} text-anchor="end">{100 * left} %</text>
        </g>
      ))}
      {[0.6, 0.8, 1, 1.2, 1.4].map((part) => (
        <text key={part} x={x(part)} y={HEIGHT - 5} text-anchor="middle">{t`${(mode.hz * part).toFixed(0)} Hz`}</text>
      ))}
      <line class="grid mark" x1={x(1)} x2={x(1)} y1={y(1)} y2={y(0)} />
      {SHAPERS.map((shaper) => (
        <path key={shaper.value} class={`curve-${shaper.value}`} d={path(shaper)} />
      ))}
    </svg>
  );
}
