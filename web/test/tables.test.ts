import { describe, expect, it } from "vitest";
import { settingNumber } from "../src/tables";

describe("the number of a setting", () => {
  it("is found by its name; of X where it is per axis", () => {
    expect(settingNumber("homing")).toBe(22);
    expect(settingNumber("max_travel_mm")).toBe(130);
  });

  it("is an error for a name that the table does not have", () => {
    expect(() => settingNumber("homimg")).toThrow("no homimg");
  });
});
