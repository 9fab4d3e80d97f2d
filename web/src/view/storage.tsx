/** The bar of the tabs that change what the board has stored: read, write, or by a file. */
import type { JSX } from "preact";
import { attempt } from "../app";
import { hasWebSerial } from "../link/serial";
import { changedImage, changes, forgetChanges, image, isChanged, openFile, progress, readBoard, source, writeBoard, written } from "../storage/board";
import { Button, FileButton, Notice, Progress, saveFile } from "./parts";
import { t } from "../words";

export function StorageBar({ problem = "" }: { problem?: string }): JSX.Element {
  const busy = progress.value !== null;
  return (
    <div class="stack">
      <div class="row">
        <Button icon="usb" disabled={busy || !hasWebSerial()} onClick={() => void attempt(readBoard)} testId="storage-read">
          {t`Read from the board`}
        </Button>
        <FileButton accept=".bin" onFile={(file) => void attempt(() => openFile(file))} testId="storage-file">
          {t`Open a file`}
        </FileButton>
        <Button
          disabled={busy || problem !== ""}
          title={t`For wificnc nvs flash`}
          onClick={() => void attempt(async () => saveFile("nvs.bin", changedImage().data))}
          testId="storage-save"
        >
          {t`Save a file`}
        </Button>
      </div>
      {busy && <Progress value={progress.value} label={t`Board`} />}
      {image.value ? (
        <p class="small soft">{t`What ${source.value} has stored.`}</p>
      ) : (
        <p class="small soft">
          {t`Read the board over USB first: it stops during this and restarts afterwards. Otherwise the values shown are the defaults of the board.`}
        </p>
      )}
      {image.value?.damaged.map((what) => <Notice key={what} kind="warn" title={t`Damaged and skipped: ${what}`} />)}
      {isChanged.value && (
        <Notice
          kind={problem ? "bad" : "warn"}
          title={changes.value.size === 1 ? t`One change is not written to the board yet` : t`${changes.value.size} changes are not written to the board yet`}
          text={problem || t`They take effect after a restart. Writing restarts the board.`}
        >
          <Button size="small" kind="primary" disabled={busy || problem !== "" || !image.value || !hasWebSerial()} onClick={() => void attempt(writeBoard)} testId="storage-write">
            {t`Write and restart`}
          </Button>
          <Button size="small" onClick={forgetChanges}>
            {t`Discard`}
          </Button>
        </Notice>
      )}
      {written.value && <Notice kind="good" title={t`Written and verified; the board has restarted`} />}
    </div>
  );
}
