/** A new firmware for the controller that serves this page. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useRef } from "preact/hooks";
import { attempt, noMotion, served } from "../app";
import { findBoard } from "../boards";
import { readUpdate, sendUpdate, waitUntilKept, type Update } from "../flash/update";
import { Button, Card, Check, Field, Notice, Progress } from "./parts";
import { t } from "../words";

type Step = "choose" | "send" | "restart" | "trial" | "done";

const update = signal<Update | null>(null);
const key = signal("");
const step = signal<Step>("choose");
const share = signal(0);
const anyBoard = signal(false);

/** Nothing where this page is not a controller's of its own. */
export function UpdateCard(): JSX.Element | null {
  const by = served.value;
  if (!by || (findBoard(by.board)?.target ?? "esp32") !== "esp32") return null; // unknown: a board file of its owner
  return (
    <Card title={t`Update the firmware`}>
      <p class="small soft">
        {t`${by.name} is a ${by.board} with version ${by.version}. Choose the firmware of this board and its signature, which lie next to each other in a release: …-firmware.bin and …-firmware.sig. Settings stay.`}
      </p>
      <ChooseFiles board={by.board} />
      {update.value && step.value === "choose" && <Send />}
      {step.value === "send" && <Progress value={share.value} label={t`Firmware`} />}
      {step.value === "restart" && <Notice kind="info" title={t`The controller checks the firmware and restarts`} text={t`Leave the power on and this page open.`} />}
      {step.value === "trial" && <Notice kind="info" title={t`The new firmware runs and is on trial`} text={t`It is kept 30 seconds after its start. If the power goes off before, the old one returns: leave it on.`} />}
      {step.value === "done" && (
        <Notice kind="good" title={t`The new firmware runs and stays`}>
          <Button size="small" onClick={() => location.reload()} testId="update-reload">
            {t`Load its page`}
          </Button>
        </Notice>
      )}
    </Card>
  );
}

function ChooseFiles({ board }: { board: string }): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  const choose = (files: readonly File[]): Promise<void> =>
    attempt(async () => {
      update.value = null;
      const read = await Promise.all(files.map(async (file) => ({ name: file.name, data: new Uint8Array(await file.arrayBuffer()) })));
      update.value = readUpdate(read, board, anyBoard.value);
      step.value = "choose";
    });
  const busy = step.value !== "choose" && step.value !== "done";
  return (
    <div class="row">
      <Button disabled={busy} onClick={() => input.current?.click()}>
        {t`Choose files`}
      </Button>
      <input
        ref={input}
        type="file"
        multiple
        class="hidden-text"
        tabIndex={-1}
        aria-label={t`Files of the firmware`}
        accept=".bin,.sig,.json"
        data-test="update-files"
        onChange={(event) => {
          const files = [...(event.currentTarget.files ?? [])];
          event.currentTarget.value = "";
          if (files.length > 0) void choose(files);
        }}
      />
      {update.value && <span class="small soft">{update.value.name}</span>}
      <Check
        label={t`Allow firmware for another board: it may drive other pins`}
        checked={anyBoard.value}
        disabled={busy}
        onChange={(on) => {
          anyBoard.value = on;
          update.value = null; // it was read with the other answer
        }}
      />
    </div>
  );
}

function Send(): JSX.Element {
  const send = (chosen: Update): Promise<void> =>
    attempt(async () => {
      share.value = 0;
      step.value = "send";
      try {
        await sendUpdate(chosen, key.value, (done) => (share.value = done));
        step.value = "restart";
        await waitUntilKept(chosen, key.value, () => (step.value = "trial"));
        step.value = "done";
      } finally {
        if (step.value !== "done") step.value = "choose";
        else key.value = "";
      }
    });
  return (
    <form
      class="stack"
      onSubmit={(event) => {
        event.preventDefault();
        if (update.value) void send(update.value);
      }}
    >
      <Field label={t`Access key`} hint={t`An update needs it also where you are logged in. It is proven, not sent.`}>
        <input class="input" type="password" value={key.value} autocomplete="off" data-test="update-key" onInput={(event) => (key.value = event.currentTarget.value)} />
      </Field>
      {noMotion.value && <p class="small soft">{noMotion.value}</p>}
      <div class="row">
        <button class="button primary" type="submit" disabled={key.value === ""} data-test="update-send">
          {t`Install`}
        </button>
      </div>
    </form>
  );
}
