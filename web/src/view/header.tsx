/** The top of the page: the link, the state, and what stops the machine, always in reach. */
import type { JSX } from "preact";
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import {
  attempt,
  connectAgain,
  connectSerial,
  connectSocket,
  controller,
  failure,
  job,
  logIn,
  noMotion,
  reconnected,
  reconnects,
  served,
  theme,
  toggleTheme,
} from "../app";
import { chooseLanguage, language } from "../language";
import { LANGUAGES, type Language } from "../languages";
import { keysWords } from "../link/keys";
import { hasWebSerial } from "../link/serial";
import { alarmWords, settingNumber } from "../tables";
import { HoldNotice, returnsBy } from "./hold";
import { Button, Dialog, Notice } from "./parts";
import { msg, t, tr } from "../words";

const STATE_KIND: Record<string, string> = {
  Idle: "good",
  Run: "busy",
  Jog: "busy",
  Home: "busy",
  Check: "busy",
  Hold: "warn",
  Tool: "warn",
  Door: "warn",
  Sleep: "warn",
  Alarm: "bad",
};

const STATE_NAMES: Record<string, string> = {
  Idle: msg`Idle`,
  Run: msg`Run`,
  Jog: msg`Jog`,
  Home: msg`Home`,
  Check: msg`Check`,
  Hold: msg`Hold`,
  Tool: msg`Tool`,
  Door: msg`Door`,
  Sleep: msg`Sleep`,
  Alarm: msg`Alarm`,
};

export function Header(): JSX.Element {
  return (
    <header class="top">
      <div class="brand">
        <img src="./icon.svg" alt="" />
        <h1>{t`WiFiCNC`}</h1>
      </div>
      <StateChip />
      <div class="link row">
        <LinkButton />
        <LanguageChoice />
        <Button
          icon={theme.value === "dark" ? "sun" : "moon"}
          label={theme.value === "dark" ? t`Light colours` : t`Dark colours`}
          onClick={toggleTheme}
        />
      </div>
      <Safety />
    </header>
  );
}

/** As wide as a button: the code is seen, and the list of names lies over it. */
function LanguageChoice(): JSX.Element {
  return (
    <span class="button icon language">
      <span aria-hidden="true">{language.value.toUpperCase()}</span>
      <select
        aria-label={t`Language`}
        title={t`Language`}
        value={language.value}
        onChange={(event) => void attempt(() => chooseLanguage(event.currentTarget.value as Language))}
        data-test="language"
      >
        {Object.entries(LANGUAGES).map(([id, name]) => (
          <option key={id} value={id} lang={id}>
            {name}
          </option>
        ))}
      </select>
    </span>
  );
}

function StateChip(): JSX.Element {
  const status = controller.status.value;
  if (!controller.connected.value || !status) return <span class="chip" data-test="state">{t`Not connected`}</span>;
  const state = controller.state.value;
  const kind = controller.silent.value ? "" : (STATE_KIND[state] ?? "");
  return (
    <span class={`chip ${kind}`} role="status" data-test="state" data-substate={status.substate}>
      {controller.silent.value ? t`Silent` : tr(STATE_NAMES[state] ?? state)}
    </span>
  );
}

/** States in which a motion continues or waits. */
const UNDER_WAY = new Set(["Run", "Hold", "Tool", "Door", "Jog", "Home"]);

function isUnderWay(): boolean {
  return job.active.value || UNDER_WAY.has(controller.state.value);
}

function LinkButton(): JSX.Element {
  const asks = useSignal(false);
  const leaves = useSignal(false);
  const leave = (): void => void attempt(() => controller.disconnect());
  if (controller.connected.value)
    return (
      <>
        <Button
          title={t`Connected to ${controller.linkName.value}`}
          onClick={() => (isUnderWay() && controller.role.value !== "observer" ? (leaves.value = true) : leave())}
          testId="disconnect"
        >
          {t`Disconnect`}
        </Button>
        {leaves.value && <LeaveDialog onClose={() => (leaves.value = false)} onLeave={leave} />}
      </>
    );
  return (
    <>
      <Button kind="primary" icon="usb" disabled={controller.link.value === "opening"} onClick={() => (asks.value = true)} testId="connect">
        {controller.link.value === "opening" ? t`Connecting` : t`Connect`}
      </Button>
      {asks.value && <ConnectDialog onClose={() => (asks.value = false)} />}
    </>
  );
}

const LOST_JOB = settingNumber("sender_lost");
/** What the controller does with a job whose sender is gone, by $74. */
const WITHOUT_SENDER = [
  msg`It finishes the lines that it has, and then stops.`,
  msg`It slows down to a feed hold, and its spindle stops.`,
  msg`It stops, and discards what it has.`,
];

function LeaveDialog({ onClose, onLeave }: { onClose: () => void; onLeave: () => void }): JSX.Element {
  const then = WITHOUT_SENDER[Number(controller.settings.value.get(LOST_JOB) ?? NaN)];
  return (
    <Dialog title={t`Disconnect while the machine is at work?`} onClose={onClose}>
      <p>
        {t`The rest of the job is not sent, and this page cannot hold or stop the machine until it is connected again. `}{" "}
        {then && t`The controller then does what $${LOST_JOB} says: ${tr(then)}`}
      </p>
      <div class="row">
        <Button kind="danger" onClick={() => (onClose(), onLeave())} testId="disconnect-anyway">
          {t`Disconnect`}
        </Button>
        <Button onClick={onClose}>{t`Stay connected`}</Button>
      </div>
    </Dialog>
  );
}

function ConnectDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const go = (connect: () => Promise<void>) => () => {
    onClose();
    void attempt(connect);
  };
  return (
    <Dialog title={t`Connect to a controller`} onClose={onClose}>
      <div class="stack">
        <Button kind="primary" icon="usb" disabled={!hasWebSerial()} onClick={go(connectSerial)} testId="connect-serial">
          {t`By USB`}
        </Button>
        <p class="small soft">
          {hasWebSerial()
            ? t`Select the board's serial port in the browser's list.`
            : t`This browser does not support serial ports: use Chrome, Edge or Opera on a computer, and open the page by https.`}
        </p>
        <Button icon="network" disabled={!served.value} onClick={go(connectSocket)} testId="connect-socket">
          {served.value ? t`By network: ${served.value.name}` : t`By network`}
        </Button>
        <p class="small soft">
          {served.value
            ? t`The controller that serves this page.`
            : t`Open this page from the controller, or from wificnc serve --http. Browsers do not allow a page from another site to connect to your network.`}
        </p>
      </div>
    </Dialog>
  );
}

/** Hold, resume and reset: on every tab, and at the bottom of a phone. */
function Safety(): JSX.Element {
  const [on, linked] = [controller.commands.value, controller.connected.value]; // everyone may stop the machine
  const state = controller.state.value;
  return (
    <div class="safety" role="group" aria-label={t`Stop the machine`}>
      <Button kind="warn" icon="hold" machine="stops" disabled={!linked} title={t`Feed hold: slow down and wait (!)`} onClick={() => controller.realtime("HOLD")} testId="hold">
        {t`Hold`}
      </Button>
      <Button
        kind={state === "Hold" || state === "Tool" || state === "Door" ? "primary" : "plain"}
        icon="play"
        machine="starts"
        disabled={!on}
        why={on && controller.operates.value && noMotion.value}
        title={controller.operates.value ? returnsBy() : t`Resume after a hold, a door or M0 (~)`}
        onClick={() => controller.realtime("RESUME")}
        testId="resume"
      >
        {t`Resume`}
      </Button>
      <Button kind="danger" icon="stop" machine="stops" disabled={!linked} title={t`Stop immediately and discard all queued lines (Ctrl-X)`} onClick={() => controller.reset()} testId="reset">
        {t`Reset`}
      </Button>
    </div>
  );
}

/** What needs attention, under the header of every tab, in room of its own: no message moves what is below. The first one
 * is seen; all of them, and all of their words, when unfolded, over the page. */
export function Notices(): JSX.Element {
  const list = useRef<HTMLDivElement>(null);
  const isUnfolded = useSignal(false);
  useEffect(() => {
    const folds = new MutationObserver(() => void (list.current?.childElementCount === 0 && (isUnfolded.value = false)));
    folds.observe(list.current!, { childList: true });
    return () => folds.disconnect();
  }, []);
  return (
    <div class={`notices ${isUnfolded.value ? "unfolded" : ""}`}>
      <div class="list" ref={list}>
        <SilentNotice />
        {failure.value && (
          <Notice kind="bad" title={failure.value.title} text={failure.value.hint}>
            <Button size="small" icon="close" label={t`Close`} onClick={() => (failure.value = null)} />
          </Notice>
        )}
        <LostNotice />
        <DroppedNotice />
        <PositionNotice />
        <RestartNotice />
        <LockedNotice />
        <ObserverNotice />
        <AlarmNotice />
        <HoldNotice />
      </div>
      <Button icon={isUnfolded.value ? "fold" : "unfold"} label={isUnfolded.value ? t`Show less` : t`Show all of it`} onClick={() => (isUnfolded.value = !isUnfolded.value)} testId="notices-unfold" />
    </div>
  );
}

function LostNotice(): JSX.Element | null {
  if (controller.link.value === "open" && reconnected.value) return <BackNotice />;
  if (controller.link.value !== "lost" && !reconnects.value) return null;
  return (
    <Notice kind="bad" title={t`The connection to ${controller.linkName.value} was lost`} text={controller.lostWhy.value}>
      {reconnects.value && <span class="small soft">{t`Trying to connect again.`}</span>}
      <Button
        size="small"
        kind="primary"
        disabled={controller.link.value === "opening"}
        onClick={() => void attempt(connectAgain)}
        testId="connect-again"
      >
        {t`Connect again`}
      </Button>
      {reconnects.value && (
        <Button size="small" onClick={() => (reconnects.value = false)}>
          {t`Stop trying`}
        </Button>
      )}
    </Notice>
  );
}

/** A link that is dead but not closed: nothing that is pressed acts. */
function SilentNotice(): JSX.Element | null {
  if (!controller.connected.value || !controller.silent.value) return null;
  return (
    <Notice
      kind="bad"
      title={t`The controller does not answer: Hold and Reset do not reach the machine`}
      text={t`Use the emergency stop at the machine. What you press here is not sent.`}
    >
      <Dropped />
    </Notice>
  );
}

/** What was pressed while nothing was sent. */
function Dropped(): JSX.Element | null {
  const dropped = controller.dropped.value;
  return dropped.length > 0 ? <strong class="small">{t`Pressed meanwhile and not sent: ${keysWords(dropped)}`}</strong> : null;
}

/** The same link answers again: what was pressed meanwhile is still not done. */
function DroppedNotice(): JSX.Element | null {
  if (!controller.connected.value || controller.silent.value || reconnected.value || controller.dropped.value.length === 0) return null;
  return (
    <Notice kind="bad" title={t`Pressed meanwhile and not sent: ${keysWords(controller.dropped.value)}`} text={t`The controller answers again. Press it once more if it is still wanted.`}>
      <Button size="small" onClick={() => (controller.dropped.value = [])}>
        {t`Close`}
      </Button>
    </Notice>
  );
}

/** Nothing that was set before is where it was: homing or a new zero, which the operator confirms, ends it. */
function PositionNotice(): JSX.Element | null {
  if (!controller.connected.value || !controller.positionLost.value) return null;
  return (
    <Notice
      kind="bad"
      title={t`The controller was switched off or restarted: its position is lost`}
      text={t`Home the machine, or jog to the work and set a new zero. Until then the job cannot be resumed.`}
    >
      <Button size="small" machine="sets" onClick={() => controller.findPosition()} testId="zero-is-new">
        {t`I have set a new zero`}
      </Button>
    </Notice>
  );
}

function BackNotice(): JSX.Element {
  const { lost_s, job: lines } = reconnected.value!;
  const close = (): void => {
    reconnected.value = null;
    controller.dropped.value = [];
  };
  return (
    <Notice
      kind="warn"
      title={t`Connected again after ${lost_s} s`}
      text={lines ? t`The job is not being sent any more. ${lines}` : t`What the machine did meanwhile was not seen here.`}
    >
      <Dropped />
      <Button size="small" onClick={close}>
        {t`Close`}
      </Button>
    </Notice>
  );
}

/** Its position is as good as its homing; one that was without power does not know it. */
function RestartNotice(): JSX.Element | null {
  if (!controller.connected.value || !controller.restarted.value) return null;
  return (
    <Notice
      kind="warn"
      title={t`The controller has started again`}
      text={t`It was without power, or someone else has reset it. Check the position, or home the machine, before you continue.`}
    >
      <Button size="small" onClick={() => (controller.restarted.value = false)}>
        {t`Close`}
      </Button>
    </Notice>
  );
}

function LockedNotice(): JSX.Element | null {
  const key = useSignal("");
  if (!controller.connected.value || !controller.locked.value) return null;
  const login = (): Promise<void> => {
    const given = key.value;
    key.value = "";
    return logIn(given);
  };
  return (
    <Notice kind="warn" title={t`This controller is locked`} text={t`Without its access key you can only view its state. The key is shown over USB.`}>
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
          aria-label={t`Access key`}
          autocomplete="current-password"
          value={key.value}
          onInput={(event) => (key.value = event.currentTarget.value)}
        />
        <button class="button primary" type="submit">
          {t`Log in`}
        </button>
      </form>
    </Notice>
  );
}

function ObserverNotice(): JSX.Element | null {
  const asks = useSignal(false);
  if (!controller.connected.value || controller.role.value !== "observer") return null;
  const take = (): void => void attempt(takeOver);
  return (
    <Notice
      kind="info"
      title={t`View only: ${controller.takenBy.value || t`another client`} is in control`}
      text={t`Hold and Reset work here, too.`}
    >
      <Button size="small" machine="sets" onClick={() => (isUnderWay() ? (asks.value = true) : take())} testId="take">
        {t`Take control`}
      </Button>
      {asks.value && (
        <Dialog title={t`Take control of a machine at work?`} onClose={() => (asks.value = false)}>
          <p>{t`Another client is sending a job or moves the machine. The machine is held, lines that have not begun are refused, and its job stays unfinished.`}</p>
          <div class="row">
            <Button kind="danger" machine="sets" onClick={() => ((asks.value = false), take())} testId="take-anyway">
              {t`Take control anyway`}
            </Button>
            <Button onClick={() => (asks.value = false)}>{t`Cancel`}</Button>
          </div>
        </Dialog>
      )}
    </Notice>
  );
}

async function takeOver(): Promise<void> {
  await controller.send("$TAKE");
}

/** The emergency stop, as Grbl and grblHAL number it. */
const ESTOP = 50;

/** It has no button that moves the machine: such a one would come and go with it. */
function AlarmNotice(): JSX.Element | null {
  if (controller.state.value !== "Alarm") return null;
  const code = controller.alarm.value;
  const homing = Number(controller.settings.value.get(settingNumber("homing")) ?? 0) > 0;
  const title = code === null ? t`The machine is locked` : t`Alarm ${code}: ${alarmWords(code)}`;
  if (controller.selfLock.value) return <Notice kind="bad" title={t`The machine is locked`} text={tr(controller.selfLock.value)} />;
  if (controller.needsReset.value || code === ESTOP)
    return (
      <Notice kind="bad" title={title} text={code === ESTOP ? t`Release the emergency stop if it is pressed, then reset.` : t`It accepts no commands until it is reset. Check the machine first.`}>
        <Button size="small" kind="danger" machine="stops" disabled={!controller.connected.value} onClick={() => controller.reset()} testId="reset-alarm">
          {t`Reset`}
        </Button>
      </Notice>
    );
  const text = homing ? t`Home it on the tab Control, or unlock it if you know its position.` : t`Unlock it if you know its position.`;
  return (
    <Notice kind="bad" title={title} text={text}>
      <Button size="small" icon="unlock" machine="sets" disabled={!controller.commands.value} onClick={() => void attempt(() => controller.send("$X"))} testId="unlock">
        {t`Unlock`}
      </Button>
    </Notice>
  );
}
