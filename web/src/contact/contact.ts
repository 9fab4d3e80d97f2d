/** The page of first contact: give a controller the network that it is to join. Small, for phones that open it by
 * themselves: it loads nothing of the main page. */
import { languageOf, type Language } from "../languages";
import { msg, t, tr, useCatalogue, type Catalogue } from "../words";
import "./contact.css";

interface Network {
  name: string;
  rssi_dbm: number;
  secured: boolean;
}

/** What GET api/network answers. */
interface State {
  trial_s: number;
  state: "none" | "joining" | "joined" | "not_found" | "wrong_password" | "failed";
  /** This browser is in the controller's own network. */
  own: boolean;
  /** It may change the network without the access key. */
  may: boolean;
  static: boolean;
  scanning: boolean;
  name: string;
  ssid: string;
  joined: string;
  address: string;
  gateway: string;
  netmask: string;
  networks: Network[];
}

const LOOK_MS = 1000;
const TICKET = "wificnc.ticket";
const FAILED: Record<string, string> = {
  wrong_password: msg`The network does not accept this password.`,
  not_found: msg`The controller cannot find this network. It supports 2.4 GHz only.`,
  failed: msg`The network refuses the controller.`,
};

function by<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

const fields = ["ssid", "password", "key", "address", "netmask", "gateway"] as const;
const input = (id: string): HTMLInputElement => by<HTMLInputElement>(id);
let state: State | null = null;
/** A change was asked for: how it goes is shown. */
let trying = sessionStorage.getItem(TICKET) !== null;
/** ... and was joined in the meantime, so that a return is one. */
let hasJoined = false;

function say(text: string, kind: "" | "good" | "bad" = ""): void {
  if (by("notice").textContent !== text) by("notice").textContent = text;
  by("notice").className = kind;
}

function show(...ids: string[]): void {
  for (const id of ["form", "where", "keep", "next"]) by(id).hidden = !ids.includes(id);
}

function blame(field: string): void {
  for (const id of [...fields, "own-name"]) input(id).removeAttribute("aria-invalid");
  const id = field === "name" ? "own-name" : field;
  if (!field || !document.getElementById(id)) return;
  if (["name", "address", "netmask", "gateway"].includes(field)) by<HTMLDetailsElement>("more").open = true;
  input(id).setAttribute("aria-invalid", "true");
  input(id).focus();
}

/** Rejects with the controller's own reason. */
async function post(body: object): Promise<{ ticket?: string }> {
  const answer = await fetch("./api/network", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ ...body, ...(by("key-field").hidden ? {} : { key: input("key").value }) }),
  });
  const said = (await answer.json()) as { ticket?: string; error?: string; field?: string };
  if (answer.ok) return said;
  by("key-field").hidden = said.field !== "key" && by("key-field").hidden;
  blame(said.field ?? "");
  throw new Error(tr(said.error ?? answer.statusText));
}

async function attempt(what: () => Promise<void>): Promise<void> {
  try {
    await what();
  } catch (error) {
    say(error instanceof Error ? error.message : String(error), "bad");
  }
}

/* ---- networks ---- */

function choose(network: Network): void {
  input("ssid").value = network.name;
  input("password").value = "";
  if (state) showNetworks(state);
  input("password").focus();
}

function showNetworks({ networks, scanning, may }: State): void {
  by("near").hidden = !may;
  by<HTMLButtonElement>("search").disabled = scanning;
  by("search").textContent = scanning ? t`Searching` : t`Search again`;
  const wanted = JSON.stringify([networks, input("ssid").value]);
  if (by("networks").dataset.shown === wanted) return;
  by("networks").dataset.shown = wanted;
  by("networks").replaceChildren(
    ...networks.map((network) => {
      const button = document.createElement("button");
      const [name, strength] = [document.createElement("b"), document.createElement("span")];
      name.textContent = network.name;
      strength.textContent = `${network.rssi_dbm} dBm${network.secured ? "" : t`, open`}`;
      strength.className = "soft";
      button.type = "button";
      button.setAttribute("aria-pressed", String(network.name === input("ssid").value));
      button.append(name, strength);
      button.addEventListener("click", () => choose(network));
      const row = document.createElement("li");
      row.append(button);
      return row;
    }),
  );
}

/* ---- how it is ---- */

function link(id: string, host: string): void {
  const ticket = sessionStorage.getItem(TICKET);
  by<HTMLAnchorElement>(id).href = `http://${host}/setup.html${ticket ? `#keep=${ticket}` : ""}`;
  by(id).textContent = `http://${host}/`;
}

function showJoined(now: State): void {
  hasJoined = true;
  by("target").textContent = now.ssid;
  by("left").textContent = String(now.trial_s);
  link("by-address", now.joined);
  link("by-name", `${now.name}.local`);
  say(t`${now.name} has joined ${now.ssid}.`, "good");
  show("where");
}

function endTrying(text: string): void {
  trying = hasJoined = false;
  sessionStorage.removeItem(TICKET);
  say(text, "bad");
  show("form");
}

/** In the own network, after a change. */
function showTrying(now: State): void {
  if (now.trial_s === 0)
    endTrying(hasJoined ? t`The page was not opened in the new network: the settings before are back.` : t`The network was not changed.`);
  else if (now.state === "joined") showJoined(now);
  else if (now.state in FAILED) {
    endTrying(tr(FAILED[now.state] ?? ""));
    blame(now.state === "wrong_password" ? "password" : "ssid");
  } else {
    say(t`The controller joins ${now.ssid}.`);
    show();
  }
}

function showState(now: State): void {
  by("name").textContent = now.name;
  showNetworks(now);
  by("key-field").hidden = now.may;
  if (trying && now.own) showTrying(now);
  else if (now.trial_s > 0 && !now.own) {
    say(t`${now.ssid} is on trial for ${now.trial_s} s.`);
    show("keep");
  } else if (by("form").hidden && by("next").hidden) {
    say(now.state === "joined" ? t`The controller is in ${now.ssid}, at ${now.joined}.` : "");
    show("form");
  }
}

async function look(): Promise<void> {
  let answer: Response;
  try {
    answer = await fetch("./api/network", { cache: "no-store" });
  } catch {
    if (state && trying) say(t`This phone has left the controller's network. Connect it to ${state.ssid}, and open ${state.joined ? `http://${state.joined}/setup.html` : `http://${state.name}.local/setup.html`}`);
    else say(t`The controller does not answer.`, "bad");
    return;
  }
  if (answer.status === 404) {
    say(t`This controller has no WiFi to set up: it uses the network of its computer.`);
    show("next");
    return;
  }
  state = (await answer.json()) as State;
  showState(state);
}

/* ---- what the user does ---- */

function wish(): object {
  const isStatic = input("static").checked;
  const addresses = { address: input("address").value, netmask: input("netmask").value, gateway: input("gateway").value };
  return {
    ssid: input("ssid").value,
    password: input("password").value,
    ...(input("own-name").value ? { name: input("own-name").value } : {}),
    mode: isStatic ? "static" : "dhcp",
    ...(isStatic ? addresses : {}),
  };
}

async function join(): Promise<void> {
  blame("");
  say("");
  const { ticket } = await post(wish());
  sessionStorage.setItem(TICKET, ticket ?? "");
  trying = true;
  hasJoined = false;
  input("password").value = "";
  await look();
}

async function keep(ticket?: string): Promise<void> {
  await post({ keep: true, ...(ticket ? { ticket } : {}) });
  sessionStorage.removeItem(TICKET);
  trying = false;
  say(t`The controller stays in ${state?.ssid ?? t`this network`}.`, "good");
  show("next");
}

async function search(): Promise<void> {
  await post({ scan: true });
  await look();
}

by("form").addEventListener("submit", (event) => {
  event.preventDefault();
  void attempt(join);
});
by("keep").addEventListener("click", () => void attempt(() => keep()));
by("search").addEventListener("click", () => void attempt(search));
input("show").addEventListener("change", () => (input("password").type = input("show").checked ? "text" : "password"));
input("static").addEventListener("change", () => (by("addresses").hidden = !input("static").checked));
input("ssid").addEventListener("input", () => state && showNetworks(state));

/* ---- its language: the browser's ---- */

const CATALOGUES: Record<Exclude<Language, "en">, () => Promise<{ default: Catalogue }>> = {
  de: () => import("virtual:catalogue/contact.de"),
  es: () => import("virtual:catalogue/contact.es"),
};

/** The texts of the file, too. A catalogue that cannot be loaded leaves the page in English. */
async function translate(): Promise<void> {
  const language = languageOf(navigator.languages);
  if (language === "en") return;
  const words = (await CATALOGUES[language]()).default;
  useCatalogue(() => words);
  document.documentElement.lang = language;
  const texts = document.createTreeWalker(document.documentElement, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode as Text;
    const text = node.data.trim();
    if (text) node.data = node.data.replace(text, tr(text));
  }
}

async function start(): Promise<void> {
  await translate().catch(() => {});
  const ticket = /^#keep=([0-9a-f]{32})$/.exec(location.hash)?.[1];
  history.replaceState(null, "", location.pathname);
  await look();
  if (ticket && state) await attempt(() => keep(ticket));
  else if (state?.may && !trying && state.trial_s === 0 && state.networks.length === 0) await attempt(search);
  setInterval(() => void look(), LOOK_MS);
}

void start();
