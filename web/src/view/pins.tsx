/** Which signal is on which pin: the board's own wiring, moved by what is stored. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { served } from "../app";
import { BOARDS, findBoard } from "../boards";
import { board, chooseBoard } from "../chosen";
import { pinoutUrl } from "../pinouts";
import { choosePin, clashes, ownPin, pinOf, refusal, swapsWith } from "../storage/board";
import { TABLES, type Board, type StoredPin } from "../tables";
import { Card, Check, Notice } from "./parts";
import { StorageBar } from "./storage";
import { NetworkPins } from "./wiring";
import { t, tr } from "../words";

const showIllegal = signal(false);
const { none } = TABLES.storage;

export function PinsTab(): JSX.Element {
  const movable = board.value.pins.length > 0;
  return (
    <div class="columns">
      <div class="w6 stack">
        <Card title={t`Pins`} tools={<BoardChoice />}>
          <UnknownBoard />
          {movable ? <MovablePins board={board.value} /> : <FixedPins board={board.value} />}
        </Card>
      </div>
      <div class="w6 stack">
        <PinoutCard />
      </div>
    </div>
  );
}

/** A controller of a board file of its owner's: the page has no pins of it, and shows those of another board. */
function UnknownBoard(): JSX.Element | null {
  const by = served.value;
  if (!by || findBoard(by.board)) return null;
  return (
    <Notice
      kind="warn"
      title={t`The pins of ${by.board} are not known here`}
      text={t`${by.name} is made from a board file of its owner's. What follows is ${tr(board.value.name)}, not the wiring of this controller.`}
    />
  );
}

export function BoardChoice(): JSX.Element {
  return (
    <select class="input" aria-label={t`Board`} value={board.value.id} onChange={(event) => chooseBoard(event.currentTarget.value)}>
      {BOARDS.map((entry) => (
        <option key={entry.id} value={entry.id}>
          {tr(entry.name)}
        </option>
      ))}
    </select>
  );
}

export function PinoutCard(): JSX.Element {
  return (
    <Card title={t`Pin-out`}>
      <a href={pinoutUrl(board.value.id)} target="_blank" rel="noreferrer" title={t`Open in a new tab`}>
        <img class="pinout" src={pinoutUrl(board.value.id)} alt={t`Pin-out of ${tr(board.value.name)}; the table of pins has the same data`} />
      </a>
      {board.value.notes.map((note) => (
        <p key={note} class="small soft" lang={tr(note) === note ? "en" : undefined}>
          {tr(note)}
        </p>
      ))}
    </Card>
  );
}

function MovablePins({ board: wired }: { board: Board }): JSX.Element {
  const wrong = clashes(wired);
  const rows = TABLES.storage.pin.filter((row) => !/^(step|dir|limit)_/.test(row.signal) || wired.axes.toLowerCase().includes(row.signal.split("_")[1]!));
  return (
    <>
      <StorageBar problem={wrong.join("; ")} />
      <NetworkPins board={wired} problem={wrong.join("; ")} />
      {wrong.length > 0 && <Notice kind="bad" title={t`The firmware would refuse this and use the board's pins`} text={wrong.join("; ")} />}
      <Check label={t`List unsuitable pins, with the reason`} checked={showIllegal.value} onChange={(on) => (showIllegal.value = on)} />
      <div class="scroll">
        <table>
          <thead>
            <tr>
              <th>{t`Signal`}</th>
              <th>{t`Pin`}</th>
              <th class="hide-narrow">{t`Board default`}</th>
            </tr>
          </thead>
          <tbody>
            {rows.map((row) => (
              <PinLine key={row.key} board={wired} row={row} />
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

function PinLine({ board: wired, row }: { board: Board; row: StoredPin }): JSX.Element {
  const number = pinOf(wired, row);
  const own = ownPin(wired, row);
  const moved = number !== (own === none ? null : own);
  const colour = wired.uses.find((use) => use.signal === row.signal)?.colour ?? "#8b99a6";
  return (
    <tr class={moved ? "changed" : ""}>
      <td>
        <svg class="swatch" viewBox="0 0 10 10" aria-hidden="true">
          <rect width="10" height="10" rx="3" fill={colour} />
        </svg>
        {tr(row.label)} <span class="small faint">{row.output ? t`out` : t`in`}</span>
      </td>
      <td>
        <select
          class="input"
          aria-label={t`Pin of ${tr(row.label)}`}
          data-test={`pin-${row.key}`}
          value={number === null ? none : number}
          onChange={(event) => choosePin(wired, row, Number(event.currentTarget.value))}
        >
          <option value={none}>{t`not wired`}</option>
          {options(wired, row, number)}
        </select>
      </td>
      <td class="soft mono small hide-narrow">{wired.pins.find((pin) => pin.number === own)?.name ?? "–"}</td>
    </tr>
  );
}

/** Legal pins first; the others with their reason, on request. */
function options(wired: Board, row: StoredPin, chosen: number | null): JSX.Element[] {
  return wired.pins.flatMap((pin) => {
    const rival = pin.number === chosen ? null : swapsWith(wired, row, pin);
    if (rival)
      return [
        <option key={pin.number} value={pin.number}>
          {t`${pin.name}: swap with ${tr(rival.label)}`}
        </option>,
      ];
    const why = refusal(wired, row, pin);
    if (why && pin.number !== chosen && !showIllegal.value) return [];
    return [
      <option key={pin.number} value={pin.number} disabled={why !== ""}>
        {pin.name}
        {why && pin.number !== chosen ? `: ${why}` : ""}
      </option>,
    ];
  });
}

function FixedPins({ board: wired }: { board: Board }): JSX.Element {
  return (
    <>
      <p class="soft small">{t`The pins of this board are set in its board file; \`wificnc build\` includes them in the firmware.`}</p>
      <div class="scroll">
        <table>
          <thead>
            <tr>
              <th>{t`Signal`}</th>
              <th>{t`Pin`}</th>
            </tr>
          </thead>
          <tbody>
            {wired.uses.map((use) => (
              <tr key={use.signal}>
                <td>{tr(use.label)}</td>
                <td class="mono">{use.pin}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

