/** A hold, under the header of every tab: the operator's hand at the machine in it, the guide of a tool change, the return. */
import type { JSX } from "preact";
import { controller, job, noMotion, preflight } from "../app";
import { settingNumber } from "../tables";
import { Button, Notice } from "./parts";
import { t } from "../words";

const RETURN_FEED = settingNumber("return_feed_mm_min");
const TOOL_CHANGE = settingNumber("tool_change");
const MEASURES = "3"; // of $341: at G59.3

/** What Resume does in a parked hold, in words. */
export function returnsBy(): string {
  const feed = Number(controller.settings.value.get(RETURN_FEED) ?? NaN);
  const down = Number.isFinite(feed) ? t`at ${feed} mm/min ($${RETURN_FEED})` : t`at the feed of $${RETURN_FEED}`;
  return t`Resume lifts Z to the highest place that you moved to, crosses to where the job was left, starts spindle and coolant as the job had them, lowers Z ${down}, and continues the job.`;
}

export function HoldNotice(): JSX.Element | null {
  const state = controller.state.value;
  if (!controller.commands.value || !["Hold", "Tool", "Door"].includes(state)) return null;
  return (
    <>
      <RefusedNotice />
      <NotMeasuredNotice />
      {controller.parked.value ? <ParkedNotice /> : <WaitingNotice />}
    </>
  );
}

/** The controller stays in its hold, and says why. */
function RefusedNotice(): JSX.Element | null {
  const why = controller.notParked.value;
  if (!why) return null;
  const leaves = why.includes("travel");
  return (
    <Notice
      kind="bad"
      title={t`Still in the hold: ${why}`}
      text={leaves ? t`Press “Jog, probe or zero here” again and correct the work zero or the tool length, then press Resume.` : undefined}
    />
  );
}

/** The words of the controller: the tool is down where it has looked for the setter, and Resume looks once more. */
function NotMeasuredNotice(): JSX.Element | null {
  const why = controller.notMeasured.value;
  if (!why) return null;
  return <Notice kind="bad" title={why} text={t`The tool is where the measuring has left it. Resume measures once more; or press “Jog, probe or zero here”, lift Z, and set the tool length or the work zero of Z by hand.`} />;
}

function WaitingNotice(): JSX.Element {
  const tool = controller.awaitedTool.value;
  const isOpen = controller.state.value === "Door" && controller.status.value?.substate !== 0;
  const rests = [t`The machine is in a hold`, job.says.value].filter(Boolean).join(": ");
  const why = isOpen ? t`Close the door first, and wait until the machine rests.` : controller.status.value?.substate === 1 ? t`Wait until the machine rests.` : "";
  return (
    <Notice
      kind="info"
      title={tool === null ? rests : t`Change to tool T${tool}, then press Resume`}
      text={tool === null ? t`Resume continues here. To move the axes before that, take the machine over by hand; the job is kept.` : toolWords(tool)}
    >
      <Button kind="primary" size="small" machine="sets" why={why} title={t`The job is kept at this step, and Resume returns to it`} onClick={() => controller.realtime("PARK")} testId="park">
        {t`Jog, probe or zero here`}
      </Button>
      {tool !== null && <ToolSteps />}
    </Notice>
  );
}

function ParkedNotice(): JSX.Element {
  const tool = controller.awaitedTool.value;
  const now = noMotion.value || t`Jog, zero, probe, spindle and coolant are yours now.`;
  return (
    <Notice kind="warn" title={tool === null ? t`Parked: the job waits for Resume` : t`Parked: fit tool T${tool}, set Z, then press Resume`} text={`${now} ${returnsBy()}`}>
      {tool !== null && <ToolSteps />}
    </Notice>
  );
}

/** The line of the job that asks for this tool, with its comment. */
function toolWords(tool: number): string {
  const changes = preflight.result.value?.report.tool_changes ?? [];
  const line = changes.find((change) => change.tool === tool && change.line >= job.currentLine.value)?.line;
  const text = job.active.value ? job.program.value?.lines.find(({ number }) => number === line)?.text : undefined;
  return text ? t`The spindle is off. The program waits in line ${line}: ${text}` : t`The spindle is off. The program waits at M6.`;
}

function ToolSteps(): JSX.Element {
  const measures = controller.settings.value.get(TOOL_CHANGE) === MEASURES;
  return (
    <ol class="steps small" data-test="tool-steps">
      <li>{t`Press “Jog, probe or zero here” and raise Z on the tab Control until you can reach the collet.`}</li>
      <li>{t`Fit the tool.`}</li>
      <li>{measures ? t`Its length is measured at the tool setter when you press Resume.` : t`Its length is different: probe Z, or touch the work and zero Z. Leave X and Y as they are.`}</li>
      <li>{t`Jog clear of the work and the clamps, then press Resume.`}</li>
    </ol>
  );
}
