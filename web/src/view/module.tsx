/** The channels of an I/O module: what they are. Only a host of WMC3 gets their levels. */
import type { JSX } from "preact";
import { board } from "../chosen";
import { channelRefusal, channels, isModule, moduleFaults, numberOf, setFlag, setNumber, setPin, storedNumber, type Channel } from "../storage/module";
import type { Board } from "../tables";
import { Card, Check, Field, Notice } from "./parts";
import { t } from "../words";

export function ModuleCard(): JSX.Element | null {
  if (board.value.target !== "esp32" || !isModule()) return null;
  const faults = moduleFaults(board.value);
  return (
    <Card title={t`Channels of the I/O module`}>
      <div class="row">
        <NumberField label={t`Channels`} name="io_count" />
        <NumberField label={t`Debouncing, ms`} name="io_debounce" />
      </div>
      {faults.length > 0 && <Notice kind="bad" title={t`The firmware would ignore these channels`} text={faults.join("; ")} />}
      <div class="scroll">
        <table>
          <thead>
            <tr>
              <th>{t`Channel`}</th>
              <th>{t`Direction`}</th>
              <th>{t`Pin`}</th>
              <th>{t`Pull-up`}</th>
              <th>{t`Inverted`}</th>
              <th>{t`Safe state`}</th>
            </tr>
          </thead>
          <tbody>
            {channels().map((channel) => (
              <ChannelLine key={channel.number} board={board.value} channel={channel} />
            ))}
          </tbody>
        </table>
      </div>
      <Check
        label={t`Outputs go to their safe state when the host is lost`}
        checked={numberOf("io_lost") === 1}
        onChange={(on) => setNumber("io_lost", on ? 1 : 0)}
      />
      <p class="small soft">
        {t`A channel is on while its pin is high, or, if inverted, low. The state of inputs and outputs is shown by`}{" "}<code>{t`wificnc wmc3 status`}</code>{t`: a module speaks the binary protocol only, and browsers cannot.`}
      </p>
    </Card>
  );
}

function NumberField({ label, name }: { label: string; name: string }): JSX.Element {
  const { min, max } = storedNumber(name);
  return (
    <Field label={label}>
      <input
        class="input short mono"
        type="number"
        min={min}
        max={max}
        data-test={name}
        value={numberOf(name)}
        onChange={(event) => setNumber(name, Number(event.currentTarget.value))}
      />
    </Field>
  );
}

function ChannelLine({ board: wired, channel }: { board: Board; channel: Channel }): JSX.Element {
  const n = channel.number;
  const flag = (name: "pullUp" | "invert" | "safe", label: string): JSX.Element => (
    <input
      type="checkbox"
      aria-label={t`${label} of channel ${n}`}
      checked={channel[name]}
      onChange={(event) => setFlag(n, name, event.currentTarget.checked)}
    />
  );
  return (
    <tr>
      <td>{n}</td>
      <td>
        <select
          class="input"
          aria-label={t`Direction of channel ${n}`}
          value={channel.output ? 1 : 0}
          onChange={(event) => setFlag(n, "output", event.currentTarget.value === "1")}
        >
          <option value={0}>{t`input`}</option>
          <option value={1}>{t`output`}</option>
        </select>
      </td>
      <td>
        <select
          class="input"
          aria-label={t`Pin of channel ${n}`}
          data-test={`pin-io_p${n}`}
          value={channel.pin ?? -1}
          onChange={(event) => setPin(n, Number(event.currentTarget.value) < 0 ? null : Number(event.currentTarget.value))}
        >
          <option value={-1}>{t`none`}</option>
          {wired.pins
            .filter((pin) => pin.number === channel.pin || channelRefusal(wired, channel, pin.number) === "")
            .map((pin) => (
              <option key={pin.number} value={pin.number}>
                {pin.name}
              </option>
            ))}
        </select>
      </td>
      <td>{channel.output ? "" : flag("pullUp", t`Pull-up`)}</td>
      <td>{flag("invert", t`Inversion`)}</td>
      <td>{channel.output ? flag("safe", t`Safe state`) : ""}</td>
    </tr>
  );
}
