/** What is reported both ways, and a line for hands. */
import { signal, useSignal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { attempt, controller, noLines } from "../app";
import { realtimeOf, typedLine } from "../link/line";
import { Button, Card } from "./parts";
import { t } from "../words";

const REMEMBERED = 50;

/** Lines that were typed, the last one at the end, and which of them is shown; they outlive a change of the tab. */
const history = signal<readonly string[]>([]);
const at = signal(0);

/** Comments stay here; a real-time command alone on its line goes as its byte. */
async function say(text: string): Promise<void> {
  const command = realtimeOf(text);
  if (command) {
    controller.note("me", text);
    if (command === "STATUS") controller.askForReport();
    else controller.realtime(command);
    return;
  }
  const line = typedLine(text);
  controller.note("me", text);
  const answer = await controller.post(line, false);
  if (answer.kind === "ok") controller.note("controller", "ok");
}

export function TerminalTab(): JSX.Element {
  const list = useRef<HTMLDivElement>(null);
  const text = useSignal("");
  const log = controller.log.value;
  useEffect(() => {
    const element = list.current;
    if (element) element.scrollTop = element.scrollHeight;
  }, [log]);

  const send = (): void => {
    const line = text.value.trim();
    if (line === "") return;
    history.value = [...history.value.slice(1 - REMEMBERED), line];
    at.value = history.value.length;
    text.value = "";
    void attempt(() => say(line));
  };
  const onKey = (event: KeyboardEvent): void => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    at.value = Math.min(history.value.length, Math.max(0, at.value + step));
    text.value = history.value[at.value] ?? "";
  };
  return (
    <Card title={t`Terminal`} tools={<Button size="small" onClick={() => (controller.log.value = [])}>{t`Clear`}</Button>}>
      <div class="terminal" ref={list} role="log" aria-label={t`Log`} tabIndex={0} data-test="terminal">
        {log.map((entry) => (
          <div key={entry.id} class={`${entry.from} ${entry.bad ? "bad" : ""}`}>
            {entry.text}
          </div>
        ))}
      </div>
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          send();
        }}
      >
        <input
          class="input mono grow"
          aria-label={t`Line to send`}
          placeholder={t`G-code or $ command`}
          autocomplete="off"
          autocapitalize="characters"
          spellcheck={false}
          value={text.value}
          onInput={(event) => (text.value = event.currentTarget.value)}
          onKeyDown={onKey}
          disabled={noLines.value !== ""}
          title={noLines.value || undefined}
          data-test="terminal-line"
        />
        <button class="button primary" type="submit" disabled={noLines.value !== ""} title={noLines.value || undefined}>
          {t`Send`}
        </button>
      </form>
      {controller.connected.value && noLines.value && <p class="small soft">{noLines.value}</p>}
    </Card>
  );
}
