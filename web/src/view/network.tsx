/** How the board joins networks, and what it asks of those who come. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, portForLoader } from "../app";
import { board } from "../chosen";
import { findNetworks, joinNetwork, type Joined, type Network } from "../flash/provision";
import { hasWebSerial } from "../link/serial";
import { LinkError } from "../link/transport";
import { setValue, valueOf } from "../storage/board";
import { TABLES, type StoredText } from "../tables";
import { Button, Card, Check, Field, Notice } from "./parts";
import { BoardChoice } from "./pins";
import { StorageBar } from "./storage";
import { UpdateCard } from "./update";
import { msg, t, tr } from "../words";

const shown = signal(false);
const TITLES: Record<string, string> = {
  wifi_ssid: msg`WiFi network`,
  wifi_pass: msg`Its password`,
  host_name: msg`Name of the controller`,
  ap_pass: msg`Password of the controller's own network`,
  access_key: msg`Access key of network clients`,
  http_names: msg`Local names of the page`,
};

/** Bytes, as the controller counts them; "" when it is good. */
function textProblem(row: StoredText, text: string): string {
  const size = new TextEncoder().encode(text).length;
  if (text === "" || (size >= row.min && size <= row.max)) return "";
  return t`${size} bytes, but it takes ${row.min} to ${row.max}`;
}

export function NetworkTab(): JSX.Element {
  const problem = TABLES.storage.text.map((row) => textProblem(row, String(valueOf(row.key) ?? ""))).find((why) => why !== "") ?? "";
  if (board.value.target !== "esp32")
    return (
      <Card title={t`Network`} tools={<BoardChoice />}>
        <p class="soft">{t`${tr(board.value.name)} has no network to set up.`}</p>
      </Card>
    );
  return (
    <div class="columns">
      <div class="w7 stack">
        <Card title={t`Network`} tools={<BoardChoice />}>
          <StorageBar problem={problem} />
          {TABLES.storage.text.map((row) => (
            <TextField key={row.key} row={row} />
          ))}
          <Check label={t`Show passwords`} checked={shown.value} onChange={(on) => (shown.value = on)} />
        </Card>
      </div>
      <div class="w5 stack">
        <UpdateCard />
        <JoinCard />
        <NeighboursCard />
        <HowCard />
      </div>
    </div>
  );
}

function TextField({ row }: { row: StoredText }): JSX.Element {
  const text = String(valueOf(row.key) ?? "");
  const problem = textProblem(row, text);
  return (
    <Field label={tr(TITLES[row.key] ?? row.help)} hint={problem || tr(row.help)}>
      <input
        class="input"
        {...kind(row)}
        autocomplete="off"
        spellcheck={false}
        aria-invalid={problem !== ""}
        value={text}
        data-test={`text-${row.key}`}
        onInput={(event) => setValue(row.key, event.currentTarget.value || null)}
      />
    </Field>
  );
}

/** Two constants and not an expression: the types of the view know each kind of input by itself. */
function kind(row: StoredText): { type: "password" } | { type: "text" } {
  return row.secret && !shown.value ? { type: "password" } : { type: "text" };
}

const network = signal("");
const password = signal("");
const joining = signal(false);
const joined = signal<Joined | null>(null);
const looking = signal(false);
const found = signal<Network[] | null>(null);

/** Immediately, while the board runs: no restart, and nothing else of what it has stored is touched. */
function JoinCard(): JSX.Element {
  const join = (): Promise<void> =>
    attempt(async () => {
      const port = await portForLoader();
      if (!port) return;
      joined.value = null;
      joining.value = true;
      try {
        joined.value = await joinNetwork(port, network.value, password.value);
        password.value = "";
      } finally {
        joining.value = false;
      }
    });
  const look = (): Promise<void> =>
    attempt(async () => {
      const port = await portForLoader();
      if (!port) return;
      looking.value = true;
      try {
        found.value = await findNetworks(port);
      } finally {
        looking.value = false;
      }
    });
  return (
    <Card title={t`Join a WiFi network now`}>
      <form
        class="stack"
        onSubmit={(event) => {
          event.preventDefault();
          void join();
        }}
      >
        <Field label={t`Network`} hint={t`The board must be connected by USB, and the machine must be stopped.`}>
          <input class="input" value={network.value} autocomplete="off" data-test="join-network" onInput={(event) => (network.value = event.currentTarget.value)} />
        </Field>
        <div class="row">
          <Button icon="network" disabled={looking.value || joining.value || !hasWebSerial()} onClick={() => void look()} testId="scan">
            {looking.value ? t`Looking` : t`Search for networks`}
          </Button>
        </div>
        {found.value && <FoundNetworks found={found.value} />}
        <Field label={t`Password`}>
          <input class="input" type="password" value={password.value} autocomplete="off" data-test="join-password" onInput={(event) => (password.value = event.currentTarget.value)} />
        </Field>
        <div class="row">
          <button class="button primary" type="submit" disabled={joining.value || network.value === "" || !hasWebSerial()} data-test="join">
            {joining.value ? t`Joining` : t`Join`}
          </button>
        </div>
      </form>
      {joined.value && (
        <Notice kind="good" title={t`${joined.value.name} is on this network`} text={`${joined.value.firmware}, ${joined.value.address}`} />
      )}
    </Card>
  );
}

/** To take one of them. */
function FoundNetworks({ found }: { found: Network[] }): JSX.Element {
  if (found.length === 0) return <p class="small faint">{t`The board found no network. It supports 2.4 GHz only.`}</p>;
  return (
    <ul class="stack bare" aria-label={t`Networks found by the board`}>
      {found.map(({ name, rssi_dbm, secured }) => (
        <li key={name} class="row">
          <Button onClick={() => (network.value = name)}>{name}</Button>
          <span class="small faint">
            {t`${rssi_dbm} dBm${secured ? "" : t`, open`}`}
          </span>
        </li>
      ))}
    </ul>
  );
}

function HowCard(): JSX.Element {
  return (
    <Card title={t`Which network it uses`}>
      <dl class="facts">
        {board.value.ethernet && <dt>{t`Ethernet`}</dt>}
        {board.value.ethernet && <dd>{t`With a cable and an address for 5 seconds; WiFi is switched off.`}</dd>}
        <dt>{t`Your WiFi`}</dt>
        <dd>{t`Its name is stored${board.value.ethernet ? t` if there is no Ethernet` : ""}; tried again after 1, 2, 4 … 60 seconds.`}</dd>
        <dt>{t`Its own`}</dt>
        <dd>{t`WiFiCNC-XXXX at 192.168.4.1: if no network name is stored, or it could not connect for a minute.`}</dd>
      </dl>
      <Notice kind="info" title={t`Its host name`} text={t`WiFiCNC-XXXX.local; wificnc discover finds it.`} />
    </Card>
  );
}

interface Neighbour {
  name: string;
  address: string;
  board: string;
}

const neighbours = signal<Neighbour[] | null>(null);
const searching = signal(false);

/** A browser cannot ask a network who is there: `wificnc serve --http` does it for the page. */
function NeighboursCard(): JSX.Element {
  const search = (): Promise<void> =>
    attempt(async () => {
      searching.value = true;
      try {
        neighbours.value = await findNeighbours();
      } finally {
        searching.value = false;
      }
    });
  return (
    <Card title={t`Controllers on this network`}>
      <div class="row">
        <Button icon="network" disabled={searching.value} onClick={() => void search()} testId="discover">
          {searching.value ? t`Looking` : t`Search for controllers`}
        </Button>
      </div>
      {neighbours.value?.length === 0 && <p class="small faint">{t`No controller answered. Controllers on another network cannot be found.`}</p>}
      <ul class="stack bare" aria-label={t`Controllers found`}>
        {neighbours.value?.map(({ name, address, board: id }) => (
          <li key={name} class="row">
            <a href={`http://${address}/`} target="_blank" rel="noreferrer">
              {name}
            </a>
            <span class="small faint">
              {address}, {id}
            </span>
          </li>
        ))}
      </ul>
    </Card>
  );
}

async function findNeighbours(): Promise<Neighbour[]> {
  const answer = await fetch(new URL("./api/discover", document.baseURI));
  if (answer.status === 404) throw new LinkError(t`This page cannot search for controllers`, t`Use wificnc discover, or open the page with wificnc serve --http.`);
  if (!answer.ok) throw new LinkError(t`This network cannot be searched`, await answer.text());
  return (await answer.json()) as Neighbour[];
}
