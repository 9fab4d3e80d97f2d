/** The shapers and the measured waves, with the numbers of tests/tune: the command line computes the same. */
import { describe, expect, it } from "vitest";
import { assignments, delay_s, impulses, leaves, measured, recommended, residual, rounding_mm, SHAPERS, type Mode, type Waves } from "../src/tune/shapers";
import { settingNumber } from "../src/tables";

const WAVES: Waves = { feed_mm_min: 2400, waves: 8, distance_mm: 7.75, first: 12, last: 4 };
const MODE: Mode = { hz: 40, damping: 0.02 };

describe("measured waves", () => {
  it("have the frequency and damping of the command line", () => {
    const mode = measured(WAVES) as Mode;
    expect(mode.hz).toBeCloseTo(41.300183, 6);
    expect(mode.damping).toBeCloseTo(0.02185098, 8);
  });

  it.each([
    [8, 0.01],
    [41.3, 0.02],
    [120, 0.15],
  ])("of a free vibration of %f Hz, damping %f, return it", (hz, damping) => {
    const damped_s = 1 / (hz * Math.sqrt(1 - damping ** 2));
    const last = Math.exp(-damping * 2 * Math.PI * hz * 6 * damped_s);
    const mode = measured({ feed_mm_min: 2400, waves: 6, distance_mm: 40 * 6 * damped_s, first: 1, last }) as Mode;
    expect(mode.hz).toBeCloseTo(hz, 9);
    expect(mode.damping).toBeCloseTo(damping, 9);
  });

  it("have the default damping without heights", () =>
    expect(measured({ ...WAVES, first: NaN, last: NaN })).toMatchObject({ damping: 0.05 }));

  it.each<[Partial<Waves>, string]>([
    [{ feed_mm_min: NaN }, "Enter the feed"],
    [{ waves: 0 }, "Enter the feed"],
    [{ distance_mm: -1 }, "Enter the feed"],
    [{ last: NaN }, "both heights"],
    [{ last: 0 }, "more than 0"],
    [{ last: 13 }, "higher than the first"],
    [{ distance_mm: 0.75 }, "This is 426.8 Hz: the shapers take 5 to 200."],
    [{ waves: 1, distance_mm: 1, first: 100, last: 1 }, "This is a damping of 0.591: the shapers take 0 to 0.5."],
  ])("are refused: %j", (change, words) => expect(measured({ ...WAVES, ...change })).toContain(words));
});

describe("a shaper for 40 Hz, damping 0.02", () => {
  it.each([
    ["ZV", [0.515706, 0.484294], [0, 12.5025], 0.152028, 0.151076, 6.05489, 9.75989],
    ["MZV", [0.306829, 0.413944, 0.279227], [0, 9.37688, 18.75375], 0.103603, 0.080908, 9.11805, 12.86561],
    ["EI", [0.279236, 0.474508, 0.246256], [0, 12.5025, 25.005], 0.022974, 0.022687, 12.09016, 20.49274],
    ["2-hump EI", [0.175286, 0.350447, 0.329101, 0.145167], [0, 12.5025, 25.005, 37.5075], 0.035457, 0.034795, 18.05547, 34.693],
  ])("%s", (name, weights, times_ms, low, high, delay_ms, rounding_um) => {
    const shape = impulses(SHAPERS.find((shaper) => shaper.name === name)!, MODE);
    weights.forEach((weight, i) => expect(shape.weights[i]).toBeCloseTo(weight, 6));
    times_ms.forEach((time, i) => expect(1e3 * shape.times_s[i]!).toBeCloseTo(time, 4));
    expect(residual(shape, { ...MODE, hz: 36 })).toBeCloseTo(low, 6);
    expect(residual(shape, { ...MODE, hz: 44 })).toBeCloseTo(high, 6);
    expect(1e3 * delay_s(shape)).toBeCloseTo(delay_ms, 4);
    expect(1e3 * rounding_mm(shape, 500)).toBeCloseTo(rounding_um, 4);
  });

  it("leaves nothing if it is ZV", () => expect(leaves(SHAPERS[0]!, MODE).here).toBeLessThan(1e-12));

  it("is MZV, unless another one is wanted", () => expect(recommended(MODE).name).toBe("MZV"));
});

it("the settings of an axis are found by name", () => {
  const numbers = ["shaper", "shaper_hz", "shaper_damping"].map((name) => settingNumber(name) + 1);
  expect([...assignments(1, SHAPERS[1]!, { hz: 41.304, damping: 0.0204 })]).toEqual([
    [numbers[0], "2"],
    [numbers[1], "41.30"],
    [numbers[2], "0.020"],
  ]);
});
