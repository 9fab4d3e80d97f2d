/** The bar of the tab Pins for the controller that serves this page: no cable. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, served } from "../app";
import { networkPins } from "../storage/board";
import { changedPins, readNetworkPins, writeNetworkPins } from "../storage/network";
import type { Board } from "../tables";
import { Button, Field, Notice } from "./parts";
import { t } from "../words";

const key = signal("");
const busy = signal(false);
const stays = signal(false);

/** While it is under way, the buttons are off. */
function work(what: () => Promise<void>): void {
  busy.value = true;
  stays.value = false;
  void attempt(what).finally(() => (busy.value = false));
}

export function NetworkPins({ board, problem }: { board: Board; problem: string }): JSX.Element | null {
  if (served.value?.board !== board.id || board.target !== "esp32") return null;
  const count = networkPins.value ? changedPins(board).size : 0;
  return (
    <div class="stack">
      <div class="row">
        <Button icon="network" disabled={busy.value} onClick={() => work(() => readNetworkPins(board))} testId="pins-read">
          {t`Read over the network`}
        </Button>
        {networkPins.value && <span class="small soft">{t`What ${served.value.name} has stored.`}</span>}
      </div>
      {count > 0 && <Write board={board} problem={problem} count={count} />}
      {stays.value && <Notice kind="good" title={t`The controller has restarted with the new pins, and they stay`} />}
    </div>
  );
}

function Write({ board, problem, count }: { board: Board; problem: string; count: number }): JSX.Element {
  const write = (): void =>
    work(async () => {
      await writeNetworkPins(board, key.value);
      key.value = "";
      stays.value = true;
    });
  return (
    <form
      class="stack"
      onSubmit={(event) => {
        event.preventDefault();
        write();
      }}
    >
      <Field label={t`Access key`} hint={t`The controller restarts. If this page cannot log in after that, the old pins return after 5 minutes.`}>
        <input class="input" type="password" value={key.value} autocomplete="off" data-test="pins-key" onInput={(event) => (key.value = event.currentTarget.value)} />
      </Field>
      <div class="row">
        <button class="button primary" type="submit" disabled={busy.value || problem !== "" || key.value === ""} data-test="pins-write">
          {busy.value ? t`Restarting` : count === 1 ? t`Store one pin and restart` : t`Store ${count} pins and restart`}
        </button>
      </div>
    </form>
  );
}
