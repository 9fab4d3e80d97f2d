/** The frame: header, tabs, and the tab that is open. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { fail, job } from "../app";
import { ControlTab } from "./control";
import { Header, Notices } from "./header";
import { JobTab } from "./job";
import { Icon, type IconName } from "./parts";
import { SettingsTab } from "./settings";
import { TerminalTab } from "./terminal";

interface Tab {
  id: string;
  title: string;
  icon: IconName;
  view: () => JSX.Element;
  /** Begins a group. */
  apart?: boolean;
}

/** A tab that comes with its first use: what opens the page stays small. */
function later(load: () => Promise<() => JSX.Element>): () => JSX.Element {
  const loaded = signal<(() => JSX.Element) | null>(null);
  let isLoading = false;
  return () => {
    const View = loaded.value;
    if (View) return <View />;
    if (!isLoading) {
      isLoading = true;
      load()
        .then((view) => (loaded.value = view), fail)
        .finally(() => (isLoading = false));
    }
    return <p class="soft">Loading</p>;
  };
}

const GuideTab = later(async () => (await import("./setup")).GuideTab);
const PinsTab = later(async () => (await import("./setup")).PinsTab);
const NetworkTab = later(async () => (await import("./setup")).NetworkTab);
const InOutTab = later(async () => (await import("./setup")).InOutTab);
const InstallTab = later(async () => (await import("./setup")).InstallTab);

const TABS: readonly Tab[] = [
  { id: "control", title: "Control", icon: "control", view: ControlTab },
  { id: "job", title: "Job", icon: "job", view: JobTab },
  { id: "terminal", title: "Terminal", icon: "terminal", view: TerminalTab },
  { id: "guide", title: "Set up", icon: "home", view: GuideTab, apart: true },
  { id: "settings", title: "Settings", icon: "settings", view: SettingsTab },
  { id: "pins", title: "Pins", icon: "pins", view: PinsTab },
  { id: "network", title: "Network", icon: "network", view: NetworkTab },
  { id: "inout", title: "Inputs and outputs", icon: "inout", view: InOutTab },
  { id: "install", title: "Install", icon: "install", view: InstallTab, apart: true },
];

const open = signal(tabOfAddress());

window.addEventListener("hashchange", () => (open.value = tabOfAddress()));

/** A job that is lost with the page should not be lost by a slip. */
window.addEventListener("beforeunload", (event) => {
  if (job.active.peek()) event.preventDefault();
});

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
      <nav class="nav" aria-label="Sections">
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
            {tab.title}
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
