import { afterEach, expect, it } from "vitest";
import { isKept } from "../src/job/kept";
import { Tabs } from "../src/job/tabs";

const open: Tabs[] = [];
function tab(...jobs: string[]): Tabs {
  const made = new Tabs((id) => jobs.includes(id));
  open.push(made);
  return made;
}

afterEach(() => open.splice(0).forEach((one) => one.close()));

it("finds the job that another tab has", async () => {
  tab("1");
  expect(await tab().elsewhere("1")).toBe(true);
});

it("finds none that only it has, or that a tab had which is closed", async () => {
  tab("1").close();
  tab("2");
  expect(await tab("1").elsewhere("1")).toBe(false);
});

it("answers each question by itself", async () => {
  tab("1");
  const asks = tab();
  expect([await asks.elsewhere("2"), await asks.elsewhere("1"), await asks.elsewhere("3")]).toEqual([false, true, false]);
});

const JOB = { id: "1", name: "a.nc", source: "G0" };
const PLACE = { id: "1", line: 3, state: "running", why: "", machine: "usb" };

it("takes what it has written", () => expect(isKept(JOB, PLACE)).toBe(true));

it.each([
  [{ ...JOB, source: undefined }, PLACE],
  [{ ...JOB, name: 7 }, PLACE],
  [JOB, { ...PLACE, line: "3" }],
  [JOB, { ...PLACE, state: null }],
  [JOB, { ...PLACE, why: {} }],
  ["text", PLACE],
  [JOB, null],
])("a damaged record is none: %j %j", (job, place) => expect(isKept(job, place)).toBe(false));
