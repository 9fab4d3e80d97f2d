import { expect, it } from "vitest";
import { FirmwareError, loadFirmware, loadIndex, type FirmwareIndex } from "../src/flash/manifest";
import { findBoard } from "../src/boards";

const BOARD = findBoard("esp32s3-devkitc")!;

async function sha256(data: Uint8Array): Promise<string> {
  const digest = await crypto.subtle.digest("SHA-256", data as Uint8Array<ArrayBuffer>);
  return Buffer.from(digest).toString("hex");
}

/** A web host with one board's firmware; `change` breaks something. */
async function host(change: (files: Map<string, Uint8Array>, index: FirmwareIndex) => void = () => {}) {
  const manifest = {
    name: "WiFiCNC",
    version: "1.0",
    builds: [{ chipFamily: "ESP32-S3", parts: [{ path: "app.bin", offset: 0x20000 }] }],
  };
  const files = new Map<string, Uint8Array>([
    ["esp32s3-devkitc/manifest.json", new TextEncoder().encode(JSON.stringify(manifest))],
    ["esp32s3-devkitc/app.bin", new Uint8Array(1000).fill(7)],
  ]);
  const rows = await Promise.all([...files].map(async ([path, data]) => ({ path, size: data.length, sha256: await sha256(data) })));
  const index: FirmwareIndex = {
    schema: 1,
    version: "1.0",
    revision: "",
    boards: [
      {
        id: BOARD.id,
        missing: null,
        manifests: [{ path: "esp32s3-devkitc/manifest.json", flash_mb: 4, memory_mode: "octal" }],
        files: rows,
      },
    ],
  };
  change(files, index);
  const get = async (path: string): Promise<Response> => {
    if (path === "firmware/index.json") return new Response(JSON.stringify(index));
    const data = files.get(path.replace("firmware/", ""));
    return data ? new Response(data as Uint8Array<ArrayBuffer>) : new Response("", { status: 404 });
  };
  return { index, get };
}

it("loads what is whole", async () => {
  const { get } = await host();
  const index = await loadIndex(get);
  const firmware = await loadFirmware(index!, BOARD, get);
  expect(firmware.chipFamily).toBe("ESP32-S3");
  expect(firmware.parts.map((part) => [part.name, part.offset, part.data.length])).toEqual([["app.bin", 0x20000, 1000]]);
});

it("reports that no firmware is stored with the page", async () => {
  expect(await loadIndex(async () => new Response("", { status: 404 }))).toBeNull();
});

it.each<[string, (files: Map<string, Uint8Array>, index: FirmwareIndex) => void, RegExp]>([
  ["a part is missing", (files) => files.delete("esp32s3-devkitc/app.bin"), /app.bin is missing \(404\)/],
  ["a part is damaged", (files) => (files.get("esp32s3-devkitc/app.bin")![5] = 8), /damaged: its SHA-256 differs/],
  ["a part is cut off", (files) => files.set("esp32s3-devkitc/app.bin", new Uint8Array(10)), /10 bytes instead of 1000/],
  ["the manifest is damaged", (files) => (files.get("esp32s3-devkitc/manifest.json")![3] = 0), /manifest.json is damaged/],
  ["the list has another format", (_files, index) => (index.schema = 2), /format 2/],
  ["the board is not there", (_files, index) => (index.boards = []), /No firmware for ESP32-S3-DevKitC/],
])("refuses when %s", async (_name, change, why) => {
  const { get } = await host(change);
  const load = async (): Promise<unknown> => loadFirmware((await loadIndex(get))!, BOARD, get);
  await expect(load()).rejects.toThrow(FirmwareError);
  await expect(load()).rejects.toThrow(why);
});

it("refuses firmware for another chip", async () => {
  const { index, get } = await host((_files, list) => (list.boards[0]!.id = "esp32-wroom32"));
  await expect(loadFirmware(index, findBoard("esp32-wroom32")!, get)).rejects.toThrow(/for an ESP32-S3/);
});
