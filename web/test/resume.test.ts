import { expect, it } from "vitest";
import { stillWords } from "../src/job/resume";

it.each([
  [["X"], "X does not move: the lines before do not position it."],
  [["X", "Z"], "X and Z do not move: the lines before do not position them."],
  [["X", "Y", "Z"], "X, Y and Z do not move: the lines before do not position them."],
])("%j that stay where they are", (axes, words) => {
  expect(stillWords(axes)).toBe(words);
});
