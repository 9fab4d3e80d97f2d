import { expect, it } from "vitest";
import { defaultsText, exportText, sendingOrder, SettingsFileError } from "../src/link/settingsfile";
import { importText } from "../src/link/settingsimport";
import { AXES, settingProblem, settingsOf } from "../src/tables";

const everything = new Map(settingsOf(AXES.length).map(({ number, row }) => [number, defaultsText(row)]));

it("reads what it has written", () => expect(importText(exportText(everything, "a test"))).toEqual(everything));

it("keeps settings that it does not know", () => {
  const values = new Map(everything).set(999, "1.5");
  expect(importText(exportText(values, "a test"))).toEqual(values);
});

it("reads what `$$` prints, and what other senders save of it", () => {
  const text = "$$\r\n$0=10 (step pulse, usec)\n$110=5000.000\n ; a note\n$120 = 400\nok\n";
  expect([...importText(text)]).toEqual([[0, "10"], [110, "5000.000"], [120, "400"]]);
});

it.each(["Grbl 1.1h ['$' for help]", "GrblHAL 1.1f ['$' or '$HELP' for help]", "ALARM:1", "> $$", "[MSG:Check Limits]", "<Idle|MPos:0,0,0>"])(
  "passes over what a terminal shows around them: %s",
  (said) => expect([...importText(`\r\n${said}\r\n$110=5000.000\r\nok\r\n`)]).toEqual([[110, "5000.000"]]),
);

it.each([
  ["$110=fast", /line 1: "\$110=fast" is not like/],
  ["$110=5000\nG1X1", /line 2/],
  ["$100=-1", /\$100=-1/],
  ["schema = 2", /schema/],
  ["schema = 1\n[settings]\nsteps_per_mm = 1", /unknown setting steps_per_mm/],
  ["schema = 1\n[axis.x]\nsteps_per_mm = -1", /steps_per_mm.x = -1/],
  ["schema = 1\n[settings]\nhoming = \"yes\"", /must be a number/],
  ["schema = ", /TOML/],
])("refuses %j", (text, why) => {
  expect(() => importText(text)).toThrow(SettingsFileError);
  expect(() => importText(text)).toThrow(why);
});

it("sends homing before soft limits, which ask for it", () => expect(sendingOrder([20, 110, 22, 0])).toEqual([22, 0, 20, 110]));

it("takes every default for a legal value", () => {
  for (const { row } of settingsOf(AXES.length)) expect(settingProblem(row, defaultsText(row))).toBe("");
});
