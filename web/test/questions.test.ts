import { expect, test } from "vitest";
import { changedBy } from "../src/link/questions";

test.each([
  ["G55", ["$G"]],
  ["g0 x1", ["$G"]],
  ["N10 G10 L20 P0 X0", ["$G", "$#"]],
  ["G28.1", ["$G", "$#"]],
  ["G43.1Z5", ["$G", "$#"]],
  ["G38.2Z-5F10", ["$G", "$#"]],
  ["#5221=7", ["$G", "$#"]],
  ["X10 (G92 here)", ["$G"]],
  ["X10 ; G92", ["$G"]],
  ["$13=1", ["$$", "$#"]],
  ["$C", ["$G"]],
  ["$J=G91X1F100", []],
  ["$H", []],
  ["(only a comment)", []],
  ["", []],
])("%s may change the answers to %s", (line, questions) => {
  expect(changedBy(line)).toEqual(questions);
});

test("a restore changes all", () => {
  expect(changedBy("$RST=*")).toEqual(["$I", "$$", "$#", "$G"]);
});
