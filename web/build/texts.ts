/** The texts of the page's source, found in its syntax tree: those of the catalogue, and those that are not in it. */
import { readdirSync, readFileSync } from "node:fs";
import { join, relative } from "node:path";
import { parseSync } from "vite";

const SOURCE = join(import.meta.dirname, "../src");
const TAGS = new Set(["t", "msg"]);
/** Attributes that no one reads: of the page's parts and of HTML and SVG. */
const NOT_READ =
  /^(accept|aria-(?!label$|description$|valuetext$|placeholder$).*|autocapitalize|autocomplete|class|colour|d|data-.*|fill|for|href|icon|id|input[mM]ode|key|kind|lang|machine|method|name|points|preserveAspectRatio|ref|rel|role|size|src|stroke.*|style|target|test|testId|transform|type|value|viewBox)$/;

/** Properties of tables and of thrown or noted things that are shown. */
const READ_PROPERTY = /^(title|text|label|hint|why|begin|question)$/;

export interface Text {
  file: string;
  line: number;
  text: string;
}

interface Node {
  type: string;
  start: number;
  [key: string]: unknown;
}

/** @return texts that are tagged, with {0} for values, and texts for people that are not */
export function textsOf(name: string, code: string): { tagged: Text[]; bare: Text[] } {
  const found = { tagged: [] as Text[], bare: [] as Text[] };
  const add = (list: Text[], node: Node, text: string): void =>
    void list.push({ file: name, line: code.slice(0, node.start).split("\n").length, text });

  function visit(node: unknown, isRead: boolean): void {
    if (Array.isArray(node)) for (const each of node) visit(each, isRead);
    else if (isNode(node)) look(node, isRead);
  }
  function look(node: Node, isRead: boolean): void {
    if (/^(Import|ExportAll|TS(Type|Interface|Literal))/.test(node.type)) return;
    const text = literalText(node);
    if (node.type === "TaggedTemplateExpression" && TAGS.has(String((node.tag as Node).name))) {
      add(found.tagged, node, templateText(node.quasi as Node));
      return visit((node.quasi as Node).expressions, false);
    }
    if (node.type === "JSXText") {
      if (hasWord(String(node.value))) add(found.bare, node, String(node.value).trim());
    } else if (node.type === "JSXAttribute") {
      if (NOT_READ.test(attributeName(node))) return;
      return visit(node.value, !/^on[A-Z]/.test(attributeName(node)));
    } else if (text !== null && (isRead ? hasWord(text) : isProse(text))) add(found.bare, node, text);
    const isInner = node.type === "TemplateLiteral" || node.type === "ConditionalExpression" || node.type === "LogicalExpression";
    const passesOn = isRead && (isInner || /^(JSXExpressionContainer|TSNonNullExpression|TSAsExpression)$/.test(node.type));
    const isShown = node.type === "Property" && READ_PROPERTY.test(String((node.key as Node).name));
    for (const [key, child] of Object.entries(node))
      if (key !== "quasis" && key !== "key") visit(child, key !== "test" && (passesOn || key === "children" || (isShown && key === "value")));
  }
  visit(parseSync(name, code).program.body, false);
  return found;
}

/** Of all files of src. */
export function allTexts(): { tagged: Text[]; bare: Text[] } {
  const files = readdirSync(SOURCE, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile() && /\.tsx?$/.test(entry.name) && entry.name !== "words.ts")
    .map((entry) => join(entry.parentPath, entry.name));
  const each = files.map((path) => textsOf(relative(SOURCE, path), readFileSync(path, "utf8")));
  return { tagged: each.flatMap(({ tagged }) => tagged), bare: each.flatMap(({ bare }) => bare) };
}

/** What a page of HTML shows before any script runs. */
export function htmlTexts(html: string): string[] {
  const shown = html.replace(/<(script|style)[^>]*>[\s\S]*?<\/\1>/g, "");
  return [...shown.matchAll(/>([^<>]+)</g)].map(([, text]) => text!.trim()).filter(hasWord);
}

function isNode(value: unknown): value is Node {
  return typeof value === "object" && value !== null && typeof (value as Node).type === "string";
}

function literalText(node: Node): string | null {
  if (node.type === "Literal") return typeof node.value === "string" ? node.value : null;
  return node.type === "TemplateLiteral" ? templateText(node) : null;
}

function templateText(node: Node): string {
  const parts = (node.quasis as { value: { cooked: string } }[]).map(({ value }) => value.cooked);
  return parts.reduce((text, part, i) => `${text}{${i - 1}}${part}`);
}

function attributeName(node: Node): string {
  const name = node.name as { name: string };
  return name.name;
}

function hasWord(text: string): boolean {
  return /[A-Za-z]{2,}/.test(text.replace(/\{\d\}|&\w+;/g, ""));
}

/** More than one word, one of them of an ordinary language. */
function isProse(text: string): boolean {
  return /[a-z]{3,}/.test(text) && /[A-Za-z{}][.,;:!?)]* +\(?[A-Za-z{]/.test(text.trim());
}
