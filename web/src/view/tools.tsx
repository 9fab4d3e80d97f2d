/** The controller's tool table: length, diameter and text of each tool, shown and changed. */
import { useSignal, type Signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { attempt, controller, noMotion } from "../app";
import { rowOf, toolLine, toolProblem, toolsOf, TOOLS_MOST, TOOL_TEXT_MOST, type Tool, type TypedTool } from "../link/tools";
import { t } from "../words";
import { sayInMm, showsInches } from "../zeroing";
import { Button, Dialog, Field } from "./parts";

const AGAIN_MS = 500;
const MM_PER_INCH = 25.4;

function shown(mm: number): string {
  return showsInches.value ? (mm / MM_PER_INCH).toFixed(4) : mm.toFixed(3);
}

function typedOf({ number, length_mm, diameter_mm, text }: Tool): TypedTool {
  return { number: String(number), length: shown(length_mm), diameter: shown(diameter_mm), text };
}

export function ToolsDialog({ onClose }: { onClose: () => void }): JSX.Element {
  const tools = useSignal<readonly Tool[] | null>(null);
  const typed = useSignal<TypedTool>({ number: String(controller.awaitedTool.peek() ?? 1), length: "", diameter: "", text: "" });
  const read = async (): Promise<void> => {
    const said = await controller.query("$#");
    if (said) tools.value = toolsOf(said, showsInches.peek());
  };
  const store = async (tool: Tool): Promise<void> => {
    await sayInMm(toolLine(tool));
    tools.value = null; // read again
  };
  const isUnknown = tools.value === null;
  useEffect(() => {
    if (!isUnknown) return undefined;
    const timer = setInterval(() => void read(), AGAIN_MS); // a question of someone else is under way
    void read();
    return () => clearInterval(timer);
  }, [isUnknown]);
  return (
    <Dialog title={t`Tool table`} onClose={onClose}>
      <p class="small soft">{t`Stored in the controller. G43 takes the length; diameter and text are for you.`}</p>
      {tools.value?.length === 0 && <p class="soft" data-test="tools-none">{t`No tool is stored.`}</p>}
      {tools.value && tools.value.length > 0 && <ToolRows tools={tools.value} onPick={(tool) => (typed.value = typedOf(tool))} />}
      <ToolForm typed={typed} known={tools.value} onStore={(tool) => void attempt(() => store(tool))} />
    </Dialog>
  );
}

function ToolRows({ tools, onPick }: { tools: readonly Tool[]; onPick: (tool: Tool) => void }): JSX.Element {
  const unit = showsInches.value ? t`inch` : "mm";
  return (
    <div class="scroll">
      <table data-test="tools">
        <thead>
          <tr>
            <th>{t`Tool`}</th>
            <th class="number">{t`Length, ${unit}`}</th>
            <th class="number">{t`Diameter, ${unit}`}</th>
            <th>{t`Text`}</th>
          </tr>
        </thead>
        <tbody>
          {tools.map((tool) => (
            <tr key={tool.number}>
              <td>
                <Button size="small" label={t`Change tool T${tool.number}`} onClick={() => onPick(tool)} testId={`tool-${tool.number}`}>{`T${tool.number}`}</Button>
              </td>
              <td class="number mono">{shown(tool.length_mm)}</td>
              <td class="number mono">{tool.diameter_mm ? shown(tool.diameter_mm) : "–"}</td>
              <td>{tool.text}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function ToolForm(props: { typed: Signal<TypedTool>; known: readonly Tool[] | null; onStore: (tool: Tool) => void }): JSX.Element {
  const { typed } = props;
  const tool = rowOf(typed.value, props.known ?? [], showsInches.value);
  const problem = toolProblem(tool);
  const unit = showsInches.value ? t`inch` : "mm";
  const field = (name: keyof TypedTool, label: string, most: number, numeric = true): JSX.Element => (
    <Field label={label}>
      <input class={`input ${numeric ? "mono" : ""}`} maxLength={most} inputMode={numeric ? "decimal" : "text"} value={typed.value[name]} onInput={(event) => (typed.value = { ...typed.value, [name]: event.currentTarget.value })} data-test={`tool-${name}`} />
    </Field>
  );
  return (
    <>
      <div class="fields">
        {field("number", t`Tool, 1 to ${TOOLS_MOST}`, 2)}
        {field("length", t`Length, ${unit}`, 12)}
        {field("diameter", t`Diameter, ${unit}`, 12)}
        {field("text", t`Text`, TOOL_TEXT_MOST, false)}
      </div>
      {problem && <p class="small" role="status">{problem}</p>}
      <div class="row">
        <Button kind="primary" why={problem || noMotion.value} disabled={props.known === null} onClick={() => props.onStore(tool)} testId="tool-store">
          {t`Store`}
        </Button>
        <Button why={noMotion.value} disabled={!props.known?.some((row) => row.number === tool.number)} onClick={() => props.onStore({ ...tool, length_mm: 0, diameter_mm: 0, text: "" })} testId="tool-clear">
          {t`Clear`}
        </Button>
      </div>
    </>
  );
}
