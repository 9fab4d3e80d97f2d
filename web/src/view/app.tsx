/** The frame: header, tabs, and the tab that is open. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, job } from "../app";
import { addBoardWords } from "../language";
import { ControlTab } from "./control";
import { Header, Notices } from "./header";
import { JobTab, open as openJob } from "./job";
import { later } from "./later";
import { Icon, type IconName } from "./parts";
import { SettingsTab } from "./settings";
import { TerminalTab } from "./terminal";
import { msg, t, tr } from "../words";

interface Tab {
  id: string;
  title: string;
  icon: IconName;
  view: (props: object) => JSX.Element;
  /** Begins a group. */
  apart?: boolean;
}

const setup = async () => (await Promise.all([import("./setup"), addBoardWords()]))[0];
const GuideTab = later(async () => (await setup()).GuideTab);
const PinsTab = later(async () => (await setup()).PinsTab);
const NetworkTab = later(async () => (await setup()).NetworkTab);
const InOutTab = later(async () => (await setup()).InOutTab);
const InstallTab = later(async () => (await setup()).InstallTab);

const TABS: readonly Tab[] = [
  { id: "control", title: msg`Control`, icon: "control", view: ControlTab },
  { id: "job", title: msg`Job`, icon: "job", view: JobTab },
  { id: "terminal", title: msg`Terminal`, icon: "terminal", view: TerminalTab },
  { id: "guide", title: msg`Set up`, icon: "home", view: GuideTab, apart: true },
  { id: "settings", title: msg`Settings`, icon: "settings", view: SettingsTab },
  { id: "pins", title: msg`Pins`, icon: "pins", view: PinsTab },
  { id: "network", title: msg`Network`, icon: "network", view: NetworkTab },
  { id: "inout", title: msg`Inputs and outputs`, icon: "inout", view: InOutTab },
  { id: "install", title: msg`Install`, icon: "install", view: InstallTab, apart: true },
];

const open = signal(tabOfAddress());

window.addEventListener("hashchange", () => (open.value = tabOfAddress()));

/** A job that is lost with the page should not be lost by a slip. */
window.addEventListener("beforeunload", (event) => {
  if (job.active.peek()) event.preventDefault();
});

/** A file that is dropped anywhere is a job: the browser would show it in place of the page, and the link would be lost. */
function onDrag(event: DragEvent): void {
  if (!event.dataTransfer?.types.includes("Files")) return;
  event.preventDefault();
  const file = event.type === "drop" ? event.dataTransfer.files[0] : undefined;
  if (!file) return;
  void attempt(() => openJob(file));
  show(TABS.find((tab) => tab.id === "job")!);
}

window.addEventListener("dragover", onDrag);
window.addEventListener("drop", onDrag);

function tabOfAddress(): Tab {
  return TABS.find((tab) => `#${tab.id}` === location.hash) ?? TABS[0]!;
}

function show(tab: Tab): void {
  history.replaceState(null, "", `#${tab.id}`);
  open.value = tab;
}

/** Arrow keys go through the tabs, as in every list of tabs. */
function onKey(event: KeyboardEvent): void {
  const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const next = TABS[(TABS.indexOf(open.value) + step + TABS.length) % TABS.length]!;
  show(next);
  document.getElementById(`tab-${next.id}`)?.focus();
}

export function App(): JSX.Element {
  const View = open.value.view;
  return (
    <div class="frame">
      <Header />
      <nav class="nav" aria-label={t`Sections`}>
        <div class="tabs" role="tablist" aria-orientation="vertical" onKeyDown={onKey}>
        {TABS.map((tab) => (
          <button
            type="button"
            key={tab.id}
            id={`tab-${tab.id}`}
            role="tab"
            class={tab.apart ? "apart" : ""}
            aria-selected={tab === open.value}
            aria-controls="view"
            tabIndex={tab === open.value ? 0 : -1}
            onClick={() => show(tab)}
          >
            <Icon name={tab.icon} />
            {tr(tab.title)}
          </button>
        ))}
        </div>
      </nav>
      <main class="main">
        <Notices />
        <div id="view" role="tabpanel" aria-labelledby={`tab-${open.value.id}`}>
          <View />
        </div>
      </main>
    </div>
  );
}
