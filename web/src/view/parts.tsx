/** The small parts that every tab is made of. */
import type { ComponentChildren, JSX } from "preact";
import { useEffect, useId, useRef } from "preact/hooks";
import { t } from "../words";

const ICONS = {
  control: "M12 3v18M3 12h18M12 3l-3 3M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3",
  job: "M6 3h8l5 5v13H6zM14 3v5h5M9 13h7M9 17h5",
  settings: "M4 7h10M18 7h2M4 17h2M10 17h10M16 5v4M8 15v4",
  pins: "M7 7h10v10H7zM10 7V3M14 7V3M10 21v-4M14 21v-4M7 10H3M7 14H3M21 10h-4M21 14h-4",
  network: "M2 9c6-5.500 14-5.500 20 0M5.500 12.500c4-3.700 9-3.700 13 0M9 16c2-1.700 4-1.700 6 0M12 19.500v.01",
  inout: "M4 8h13M13 4l4 4-4 4M20 16H7M11 12l-4 4 4 4",
  terminal: "M4 5h16v14H4zM7.500 9.500l3 2.500-3 2.500M13 15h4",
  install: "M12 3v11M8 10l4 4 4-4M4 17v3h16v-3",
  hold: "M8 5v14M16 5v14",
  play: "M7 5l12 7-12 7z",
  stop: "M8 3h8l5 5v8l-5 5H8l-5-5V8z",
  home: "M4 11l8-7 8 7M6 10v10h12V10",
  unlock: "M6 11h12v9H6zM9 11V7a3.500 3.500 0 0 1 6.500-1.800",
  moon: "M20 14A8.500 8.500 0 0 1 10 4a8.500 8.500 0 1 0 10 10z",
  sun: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8zM12 2v2M12 20v2M2 12h2M20 12h2M5 5l1.500 1.500M17.500 17.500L19 19M5 19l1.500-1.500M17.500 6.500L19 5",
  usb: "M12 21V5M12 5l-2.500 3M12 5l2.500 3M12 17l-5-3v-3M12 14l5-3V9M6 11h2M16 9h2",
  close: "M6 6l12 12M18 6L6 18",
  up: "M12 19V6M6 12l6-6 6 6",
  unfold: "M6 9l6 6 6-6",
  fold: "M6 15l6-6 6 6",
  down: "M12 5v13M6 12l6 6 6-6",
  left: "M19 12H6M12 6l-6 6 6 6",
  right: "M5 12h13M12 6l6 6-6 6",
} as const;

export type IconName = keyof typeof ICONS;

export function Icon({ name }: { name: IconName }): JSX.Element {
  return (
    <svg class="icon-svg" viewBox="0 0 24 24" aria-hidden="true">
      <path d={ICONS[name]} />
    </svg>
  );
}

export interface ButtonProps {
  children?: ComponentChildren;
  onClick?: () => void;
  kind?: "plain" | "primary" | "danger" | "warn";
  size?: "usual" | "small";
  icon?: IconName;
  /** For whoever does not see the icon; needed without children. */
  label?: string;
  disabled?: boolean;
  /** Why it cannot be pressed now, for the eye and for screen readers; "": it can. */
  why?: string | false;
  title?: string;
  pressed?: boolean;
  /** What it does to the machine: press.ts guards what starts motion or a tool, and what sets something. */
  machine?: Machine;
  testId?: string;
}

type Machine = "starts" | "stops" | "sets";

export function Button(props: ButtonProps): JSX.Element {
  const { kind = "plain", size = "usual", icon, label, children } = props;
  const bare = icon !== undefined && children === undefined;
  return (
    <button
      type="button"
      class={`button ${kind} ${size} ${bare ? "icon" : ""}`}
      onClick={props.onClick}
      disabled={props.disabled || Boolean(props.why)}
      title={props.why || (props.title ?? (bare ? label : undefined))}
      aria-label={label}
      aria-pressed={props.pressed}
      data-machine={props.machine}
      data-test={props.testId}
    >
      {icon && <Icon name={icon} />}
      {children}
    </button>
  );
}

interface Act {
  text: string;
  onClick: () => void;
  testId: string;
}

interface StartStopProps {
  start: Act & { why?: string | false };
  stop: Act;
  runs: boolean;
  /** Stop was pressed. */
  isStopping?: boolean;
  children?: ComponentChildren;
}

/** Start and Stop of one thing: two places that never change. Each is dead while it has nothing to do. */
export function StartStop({ start, stop, runs, isStopping, children }: StartStopProps): JSX.Element {
  return (
    <div class="start-stop">
      <Button kind="primary" icon="play" machine="starts" why={start.why} disabled={runs} onClick={start.onClick} testId={start.testId}>
        {start.text}
      </Button>
      <Button kind="danger" icon="stop" machine="stops" disabled={!runs || isStopping} onClick={stop.onClick} testId={stop.testId}>
        {stop.text}
      </Button>
      {children}
    </div>
  );
}

export function Card(props: { title: string; width?: string; tools?: ComponentChildren; children: ComponentChildren }): JSX.Element {
  const id = useId();
  return (
    <section class={`card ${props.width ?? ""}`} aria-labelledby={id}>
      <header>
        <h2 id={id}>{props.title}</h2>
        {props.tools && <div class="row">{props.tools}</div>}
      </header>
      {props.children}
    </section>
  );
}

export function Notice(props: {
  kind: "info" | "good" | "warn" | "bad";
  title: string;
  text?: string;
  children?: ComponentChildren;
}): JSX.Element {
  return (
    <div class={`notice ${props.kind}`} role={props.kind === "bad" ? "alert" : "status"}>
      <div class="grow">
        <strong>{props.title}</strong>
        {props.text && <div class="text small">{props.text}</div>}
      </div>
      {props.children && <div class="row">{props.children}</div>}
    </div>
  );
}

export function Field(props: { label: string; hint?: string; children: ComponentChildren }): JSX.Element {
  return (
    <label class="field">
      <span class="label">{props.label}</span>
      {props.children}
      {props.hint && <span class="small faint">{props.hint}</span>}
    </label>
  );
}

export function Segments<T extends string | number>(props: {
  label: string;
  value: T;
  options: readonly { value: T; text: string }[];
  onChange: (value: T) => void;
}): JSX.Element {
  return (
    <div class="segments" role="group" aria-label={props.label}>
      {props.options.map((option) => (
        <button
          type="button"
          key={String(option.value)}
          aria-pressed={option.value === props.value}
          onClick={() => props.onChange(option.value)}
        >
          {option.text}
        </button>
      ))}
    </div>
  );
}

export function Check(props: { label: string; checked: boolean; onChange: (on: boolean) => void; disabled?: boolean }): JSX.Element {
  return (
    <label class="check">
      <input
        type="checkbox"
        checked={props.checked}
        disabled={props.disabled}
        onChange={(event) => props.onChange(event.currentTarget.checked)}
      />
      {props.label}
    </label>
  );
}

export function Progress(props: { value: number | null; label: string }): JSX.Element {
  return <progress class="progress" aria-label={props.label} max={1} value={props.value ?? undefined} />;
}

/** A modal question. Escape, and the cross, are "no". Text that appears in it makes it grow upwards: its actions, at the bottom,
 * stay where they are. */
export function Dialog(props: { title: string; onClose: () => void; actions?: ComponentChildren; children: ComponentChildren }): JSX.Element {
  const dialog = useRef<HTMLDialogElement>(null);
  const id = useId();
  useEffect(() => {
    dialog.current?.showModal();
  }, []);
  return (
    <dialog ref={dialog} onClose={props.onClose} aria-labelledby={id}>
      <div class="dialog-body">
        <div class="row between">
          <h2 id={id}>{props.title}</h2>
          <Button icon="close" label={t`Close`} size="small" onClick={() => dialog.current?.close()} />
        </div>
        {props.children}
      </div>
      {props.actions && <footer>{props.actions}</footer>}
    </dialog>
  );
}

/** A file chooser that looks like a button. */
export function FileButton(props: { children: string; accept: string; onFile: (file: File) => void; kind?: "plain" | "primary"; size?: "usual" | "small"; testId?: string }): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <Button kind={props.kind ?? "plain"} size={props.size} onClick={() => input.current?.click()}>
        {props.children}
      </Button>
      <input
        ref={input}
        type="file"
        class="hidden-text"
        tabIndex={-1}
        aria-label={props.children}
        accept={props.accept}
        data-test={props.testId}
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          event.currentTarget.value = "";
          if (file) props.onFile(file);
        }}
      />
    </>
  );
}

/** Give the user a file. */
export function saveFile(name: string, data: string | Uint8Array<ArrayBuffer>): void {
  const url = URL.createObjectURL(new Blob([data]));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  URL.revokeObjectURL(url);
}

export function duration(seconds: number): string {
  const whole = Math.round(seconds);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  if (h > 0) return t`${h} h ${m} min`;
  return m > 0 ? t`${m} min ${s} s` : `${seconds < 10 ? seconds.toFixed(1) : s} s`;
}
