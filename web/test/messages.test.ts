import { describe, expect, it } from "vitest";
import { LineSplitter, modesNow, parse, receiveBuffer } from "../src/link/messages";

const bytes = (text: string): Uint8Array => new TextEncoder().encode(text);

describe("parse", () => {
  it("reads a report with every field that Grbl 1.1 has", () => {
    const line = "<Hold:0|MPos:1.000,-2.500,3.000|Bf:15,128|Ln:99999|FS:500,8000|Pn:XYZPDHRS|WCO:0.500,0.000,-1.000|Ov:120,50,90|A:SFM>";
    expect(parse(line)).toEqual({
      kind: "status",
      status: {
        state: "Hold",
        substate: 0,
        mpos: [1, -2.5, 3],
        wpos: null,
        wco: [0.5, 0, -1],
        plannerFree: 15,
        rxFree: 128,
        line: 99999,
        feed: 500,
        speed: 8000,
        measured: null,
        ampere: null,
        pins: "XYZPDHRS",
        overrides: [120, 50, 90],
        accessories: "SFM",
      },
    });
  });

  it("says whether a pendant has control, where the report does", () => {
    const mpg = (report: string): unknown => (parse(report) as { status: { mpg?: boolean } }).status.mpg;
    expect(mpg("<Idle|MPos:0.000,0.000,0.000|FS:0,0|MPG:1>")).toBe(true);
    expect(mpg("<Idle|MPos:0.000,0.000,0.000|FS:0,0|MPG:0>")).toBe(false);
    expect(mpg("<Idle|MPos:0.000,0.000,0.000|FS:0,0>")).toBeUndefined();
  });

  it("reads the measured speed of a spindle and the current of its drive", () => {
    const message = parse("<Run|MPos:0.000,0.000,0.000|FS:500,8000,7950|Amp:3.1>");
    expect(message).toMatchObject({ kind: "status", status: { feed: 500, speed: 8000, measured: 7950, ampere: 3.1 } });
  });

  it.each([["ok"], ["error:22"], ["ALARM:1"], ["Grbl 1.1h ['$' for help]"], ["$110=500.000"], ["[MSG:Caution: Unlocked]"]])(
    "knows %s",
    (line) => expect(parse(line).kind).not.toBe("other"),
  );

  it.each([["<Idle|MPos:1.000,nan>"], ["<Idle>"], ["<1|MPos:0,0,0>"], ["okay"], ["error:x"]])("takes %s for nothing", (line) =>
    expect(parse(line)).toEqual({ kind: "other", text: line }),
  );
});

describe("LineSplitter", () => {
  it("gives the same lines however the bytes were cut", () => {
    const text = "ok\r\n<Idle|MPos:0.000,0.000,0.000>\r\n[MSG:\u00e4]\n\nerror:9\r\n";
    const whole = new LineSplitter().take(bytes(text));
    for (let size = 1; size < 9; size++) {
      const splitter = new LineSplitter();
      const data = bytes(text);
      const got: string[] = [];
      for (let at = 0; at < data.length; at += size) got.push(...splitter.take(data.subarray(at, at + size)));
      expect(got).toEqual(whole);
    }
    expect(whole).toEqual(["ok", "<Idle|MPos:0.000,0.000,0.000>", "[MSG:\u00e4]", "error:9"]);
  });
});

it("finds the receive buffer in [OPT:]", () => {
  expect(receiveBuffer("V,15,128")).toBe(128);
  expect(receiveBuffer("V")).toBeNull();
});

describe("the modes of the last $G, in a program that has changed the spindle since", () => {
  it.each([
    ["M5", "SF", 8000, "M3"],
    ["M5", "C", 8000, "M4"],
    ["M3", "C", 500, "M4"],
    ["M3", "", 0, "M5"],
    ["M3", "", 500, "M3"], // no report has named the accessories yet
    ["M5", "", 0, "M5"],
  ])("%s with A:%s at %i rpm is %s", (last, accessories, rpm, now) => {
    expect(modesNow(`G0 G54 ${last} M9 T0 F0 S0`, accessories, rpm)).toBe(`G0 G54 ${now} M9 T0 F0 S0`);
  });
});
