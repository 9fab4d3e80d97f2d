/** The addresses whose senders command without a login: listed, added, revoked. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { attempt, controller, noLines } from "../app";
import { trustedOf, type Trusted } from "../link/trust";
import { Button, Card, duration } from "./parts";
import { t } from "../words";

const trusted = signal<Trusted[] | null>(null);

async function ask(line: string): Promise<string[]> {
  if (noLines.value) throw new Error(noLines.value);
  return controller.send(line);
}

async function list(): Promise<void> {
  trusted.value = trustedOf(await ask("$TRUST"));
}

/** @param word  of $TRUST= */
async function change(word: string): Promise<void> {
  await ask(`$TRUST=${word}`);
  await list();
}

export function TrustCard(): JSX.Element | null {
  if (!controller.commands.value) return null;
  const rows = trusted.value;
  const tools = (
    <>
      <Button size="small" onClick={() => void attempt(list)} testId="trust-list">
        {t`Show`}
      </Button>
      <Button size="small" onClick={() => void attempt(() => change("day"))} testId="trust-day">
        {t`Trust this computer for a day`}
      </Button>
      <Button size="small" onClick={() => void attempt(() => change("always"))}>
        {t`Trust it always`}
      </Button>
    </>
  );
  return (
    <Card title={t`Trusted addresses`} tools={tools}>
      <p class="soft">{t`Senders at these addresses may move the machine without the access key.`}</p>
      {rows !== null && rows.length === 0 && <p>{t`None`}</p>}
      {rows !== null && rows.length > 0 && <div class="scroll"><TrustTable rows={rows} /></div>}
    </Card>
  );
}

function TrustTable({ rows }: { rows: readonly Trusted[] }): JSX.Element {
  return (
    <table data-test="trusted">
      <tbody>
        {rows.map((row) => (
          <tr key={row.number}>
            <td>{row.address}</td>
            <td>{row.seconds === null ? t`always` : t`for ${duration(row.seconds)}`}</td>
            <td>
              <Button size="small" label={t`Revoke ${row.address}`} onClick={() => void attempt(() => change(`no ${row.number}`))}>
                {t`Revoke`}
              </Button>
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
