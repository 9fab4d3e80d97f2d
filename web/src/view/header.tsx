/** The top of the page: the link, the state, and what stops the machine, always in reach. */
import type { JSX } from "preact";
import { useSignal } from "@preact/signals";
import { attempt, connectAgain, connectSerial, connectSocket, controller, failure, served, theme, toggleTheme } from "../app";
import { hasWebSerial } from "../link/serial";
import { alarmWords, settingNumber } from "../tables";
import { Button, Dialog, Notice } from "./parts";

const STATE_KIND: Record<string, string> = {
  Idle: "good",
  Run: "busy",
  Jog: "busy",
  Home: "busy",
  Check: "busy",
  Hold: "warn",
  Door: "warn",
  Sleep: "warn",
  Alarm: "bad",
};

export function Header(): JSX.Element {
  return (
    <header class="top">
      <div class="brand">
        <img src="./icon.svg" alt="" />
        <h1>WiFiCNC</h1>
      </div>
      <StateChip />
      <div class="link row">
        <LinkButton />
        <Button
          icon={theme.value === "dark" ? "sun" : "moon"}
          label={theme.value === "dark" ? "Light colours" : "Dark colours"}
          onClick={toggleTheme}
        />
      </div>
      <Safety />
    </header>
  );
}

function StateChip(): JSX.Element {
  const status = controller.status.value;
  if (!controller.connected.value || !status) return <span class="chip">Not connected</span>;
  const state = controller.state.value;
  const kind = controller.silent.value ? "" : (STATE_KIND[state] ?? "");
  return (
    <span class={`chip ${kind}`} role="status" data-test="state" data-substate={status.substate}>
      {controller.silent.value ? "Silent" : state}
    </span>
  );
}

function LinkButton(): JSX.Element {
  const asks = useSignal(false);
  if (controller.connected.value)
    return (
      <Button title={`Connected to ${controller.linkName.value}`} onClick={() => void attempt(() => controller.disconnect())}>
        Disconnect
      </Button>
    );
  return (
    <>
      <Button kind="primary" icon="usb" disabled={controller.link.value === "opening"} onClick={() => (asks.value = true)} testId="connect">
        {controller.link.value === "opening" ? "Connecting" : "Connect"}
      </Button>
      {asks.value && <ConnectDialog onClose={() => (asks.value = false)} />}
    </>
  );
}

function ConnectDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const go = (connect: () => Promise<void>) => () => {
    onClose();
    void attempt(connect);
  };
  return (
    <Dialog title="Connect to a controller" onClose={onClose}>
      <div class="stack">
        <Button kind="primary" icon="usb" disabled={!hasWebSerial()} onClick={go(connectSerial)} testId="connect-serial">
          By USB
        </Button>
        <p class="small soft">
          {hasWebSerial()
            ? "Select the board's serial port in the browser's list."
            : "This browser does not support serial ports: use Chrome, Edge or Opera on a computer, and open the page by https."}
        </p>
        <Button icon="network" disabled={!served.value} onClick={go(connectSocket)} testId="connect-socket">
          {served.value ? `By network: ${served.value.name}` : "By network"}
        </Button>
        <p class="small soft">
          {served.value
            ? "The controller that serves this page."
            : "Open this page from the controller, or from wificnc serve --http. Browsers do not allow a page from another site to connect to your network."}
        </p>
      </div>
    </Dialog>
  );
}

/** Hold, resume and reset: on every tab, and at the bottom of a phone. */
function Safety(): JSX.Element {
  const on = controller.commands.value;
  const state = controller.state.value;
  return (
    <div class="safety" role="group" aria-label="Stop the machine">
      <Button kind="warn" icon="hold" disabled={!on} title="Feed hold: slow down and wait (!)" onClick={() => controller.realtime("HOLD")} testId="hold">
        Hold
      </Button>
      <Button
        kind={state === "Hold" || state === "Door" ? "primary" : "plain"}
        icon="play"
        disabled={!on}
        title="Resume after a hold, a door or M0 (~)"
        onClick={() => controller.realtime("RESUME")}
        testId="resume"
      >
        Resume
      </Button>
      <Button kind="danger" icon="stop" disabled={!on} title="Stop immediately and discard all queued lines (Ctrl-X)" onClick={() => controller.reset()} testId="reset">
        Reset
      </Button>
    </div>
  );
}

/** What needs attention, under the header of every tab. */
export function Notices(): JSX.Element {
  return (
    <div class="notices">
      {failure.value && (
        <Notice kind="bad" title={failure.value.title} text={failure.value.hint}>
          <Button size="small" onClick={() => (failure.value = null)}>
            Close
          </Button>
        </Notice>
      )}
      <LostNotice />
      <LockedNotice />
      <ObserverNotice />
      <AlarmNotice />
      <ToolNotice />
    </div>
  );
}

function LostNotice(): JSX.Element | null {
  if (controller.link.value !== "lost") return null;
  return (
    <Notice kind="bad" title={`The connection to ${controller.linkName.value} was lost`} text={controller.lostWhy.value}>
      <Button size="small" kind="primary" onClick={() => void attempt(connectAgain)} testId="connect-again">
        Connect again
      </Button>
    </Notice>
  );
}

function LockedNotice(): JSX.Element | null {
  const key = useSignal("");
  if (!controller.connected.value || !controller.locked.value) return null;
  const login = async (): Promise<void> => {
    const said = controller.login(key.value);
    key.value = "";
    if (!(await said)) return;
    controller.locked.value = false;
    await controller.getToKnow();
  };
  return (
    <Notice kind="warn" title="This controller is locked" text="Without its access key you can only view its state. The key is shown over USB.">
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          void attempt(login);
        }}
      >
        <input
          class="input"
          type="password"
          aria-label="Access key"
          autocomplete="current-password"
          value={key.value}
          onInput={(event) => (key.value = event.currentTarget.value)}
        />
        <button class="button primary" type="submit">
          Log in
        </button>
      </form>
    </Notice>
  );
}

function ObserverNotice(): JSX.Element | null {
  if (!controller.connected.value || controller.role.value !== "observer") return null;
  return (
    <Notice kind="info" title="View only" text="Another client is in control of this controller.">
      <Button size="small" onClick={() => void attempt(takeOver)} testId="take">
        Take control
      </Button>
    </Notice>
  );
}

async function takeOver(): Promise<void> {
  await controller.send("$TAKE");
  await controller.getToKnow();
}

function ToolNotice(): JSX.Element | null {
  const tool = controller.awaitedTool.value;
  if (tool === null) return null;
  return <Notice kind="info" title={`Change to tool T${tool}, then press Resume`} text="The spindle is off. The program waits at M6." />;
}

function AlarmNotice(): JSX.Element | null {
  if (controller.state.value !== "Alarm") return null;
  const code = controller.alarm.value;
  const homing = Number(controller.settings.value.get(settingNumber("homing")) ?? 0) > 0;
  const title = code === null ? "The machine is locked" : `Alarm ${code}: ${alarmWords(code)}`;
  if (controller.needsReset.value)
    return (
      <Notice kind="bad" title={title} text="It accepts no commands until it is reset. Check the machine first.">
        <Button size="small" kind="danger" disabled={!controller.commands.value} onClick={() => controller.reset()}>
          Reset
        </Button>
      </Notice>
    );
  const text = homing ? "Home it, or unlock it if you know its position." : "Unlock it if you know its position.";
  return (
    <Notice kind="bad" title={title} text={text}>
      {homing && (
        <Button size="small" icon="home" disabled={!controller.commands.value} onClick={() => void attempt(() => controller.send("$H"))}>
          Home
        </Button>
      )}
      <Button size="small" icon="unlock" disabled={!controller.commands.value} onClick={() => void attempt(() => controller.send("$X"))} testId="unlock">
        Unlock
      </Button>
    </Notice>
  );
}
