/** Firmware onto a board: choose it, look at its pins, plug it in, install. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { attempt, fail, portForLoader } from "../app";
import { BOARDS } from "../boards";
import { board, chooseBoard } from "../chosen";
import { BoardDevice, type Chip } from "../flash/device";
import { loadFirmware, loadIndex, type FirmwareIndex } from "../flash/manifest";
import { hasWebSerial } from "../link/serial";
import type { Board } from "../tables";
import { Button, Card, Check, Notice, Progress } from "./parts";
import { PinoutCard } from "./pins";
import { msg, t, tr } from "../words";

type Stage = "rest" | "loading" | "connecting" | "writing" | "done";

const index = signal<FirmwareIndex | null | undefined>(undefined);
const stage = signal<Stage>("rest");
const erase = signal(false);
const done = signal<{ part: string; share: number }>({ part: "", share: 0 });
const found = signal<Chip | null>(null);
const warnings = signal<readonly string[]>([]);
const log = signal<readonly string[]>([]);
const LOG_LINES = 200;

const STAGES: Record<Stage, string> = {
  rest: "",
  loading: msg`Loading and checking the firmware`,
  connecting: msg`Identifying the board`,
  writing: msg`Writing`,
  done: "",
};

export function InstallTab(): JSX.Element {
  useEffect(() => {
    if (index.value === undefined) void loadIndex().then((list) => (index.value = list), fail);
  }, []);
  const boards = BOARDS.filter((entry) => entry.target !== "host");
  return (
    <div class="columns">
      <div class="w6 stack">
        <Card title={t`1  Your board`}>
          <div class="boards">
            {boards.map((entry) => (
              <BoardButton key={entry.id} board={entry} />
            ))}
          </div>
        </Card>
        <InstallCard />
      </div>
      <div class="w6 stack">
        <PinoutCard />
      </div>
    </div>
  );
}

function BoardButton({ board: entry }: { board: Board }): JSX.Element {
  return (
    <button type="button" class="board" aria-pressed={entry.id === board.value.id} data-test={`board-${entry.id}`} onClick={() => chooseBoard(entry.id)}>
      <strong>{tr(entry.name)}</strong>
      <span class="small soft">{tr(entry.summary)}</span>
      <span class="small soft mono">
        {t`${tr(entry.chip_name)}, ${entry.axes.length} axes, ${(entry.step_rate_hz / 1000).toFixed(0)} k steps/s`}
      </span>
    </button>
  );
}

function InstallCard(): JSX.Element {
  const row = index.value?.boards.find((entry) => entry.id === board.value.id);
  const usb = board.value.target === "esp32";
  const busy = ["loading", "connecting", "writing"].includes(stage.value);
  return (
    <Card title={t`2  Install`}>
      {index.value === null && (
        <Notice kind="warn" title={t`No firmware is stored with this page`} text={t`The page of a release includes it. From a checkout: wificnc build, then wificnc flash.`} />
      )}
      {row?.missing && <Notice kind="warn" title={t`No firmware for this board`} text={t`This page has none for it. Build it on your computer: wificnc build ${board.value.id}, then wificnc flash ${board.value.id}.`} />}
      {!usb && (
        <Notice kind="info" title={t`This board cannot be flashed from a browser`} text={t`Use the command line: wificnc flash ${board.value.id}`} />
      )}
      {!hasWebSerial() && usb && (
        <Notice kind="warn" title={t`This browser does not support serial ports`} text={t`Use Chrome, Edge or Opera on a computer, with a page opened by https or from this computer.`} />
      )}
      {usb && (
        <>
          <p class="soft small">
            {t`Connect the board by USB. Its stored settings, networks and pins are not changed unless you erase everything.`}
          </p>
          <Check label={t`Erase everything first`} checked={erase.value} disabled={busy} onChange={(on) => (erase.value = on)} />
          <div class="row">
            <Button kind="primary" icon="install" disabled={busy || !row?.manifests.length || !hasWebSerial()} onClick={() => void attempt(install)} testId="install">
              {t`Install`}{" "}{index.value?.version ?? ""}
            </Button>
            {busy && <span class="soft">{tr(STAGES[stage.value])}</span>}
          </div>
        </>
      )}
      <Result />
    </Card>
  );
}

function Result(): JSX.Element {
  const chip = found.value;
  return (
    <>
      {stage.value === "writing" && (
        <>
          <Progress value={done.value.share} label={t`Writing`} />
          <p class="small soft mono">{done.value.part}</p>
        </>
      )}
      {stage.value === "done" && (
        <Notice kind="good" title={t`Installed and verified`} text={t`The board has restarted. Connect by USB, or set your WiFi in the Network tab.`} />
      )}
      {chip && (
        <dl class="facts small">
          <dt>{t`Chip`}</dt>
          <dd>{chip.description}</dd>
          <dt>{t`Flash`}</dt>
          <dd>{t`${chip.flashMb} MB`}</dd>
          <dt>{t`MAC`}</dt>
          <dd class="mono">{chip.mac}</dd>
        </dl>
      )}
      {warnings.value.map((text) => (
        <Notice key={text} kind="warn" title={text} />
      ))}
      {log.value.length > 0 && (
        <details>
          <summary class="small soft">{t`Boot loader messages`}</summary>
          <pre class="code">{log.value.join("\n")}</pre>
        </details>
      )}
    </>
  );
}

/** Everything is loaded and checked, and the board asked what it is, before a byte is written. */
async function install(): Promise<void> {
  const list = index.value;
  if (!list) return;
  found.value = null;
  warnings.value = log.value = [];
  try {
    const port = await portForLoader();
    if (!port) return;
    stage.value = "loading";
    const firmware = await loadFirmware(list, board.value);
    stage.value = "connecting";
    const device = await BoardDevice.open(port, (line) => (log.value = [...log.value.slice(-LOG_LINES), line]));
    try {
      found.value = device.chip;
      warnings.value = device.check(firmware);
      stage.value = "writing";
      const total = firmware.parts.reduce((sum, part) => sum + part.data.length, 0);
      await device.write(firmware.parts, erase.value, progressOf(firmware.parts, total));
      stage.value = "done";
    } finally {
      await device.close(stage.value === "done");
    }
  } finally {
    if (stage.value !== "done") stage.value = "rest";
  }
}

/** The loader counts each part by itself, and packed; the bar is for all of them. */
function progressOf(parts: readonly { name: string; data: Uint8Array }[], total: number) {
  return (name: string, written: number, size: number): void => {
    const at = parts.findIndex((part) => part.name === name);
    const before = parts.slice(0, at).reduce((sum, part) => sum + part.data.length, 0);
    const share = size ? written / size : 0;
    done.value = { part: name, share: (before + share * (parts[at]?.data.length ?? 0)) / total };
  };
}
