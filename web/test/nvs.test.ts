import { expect, it } from "vitest";
import { crc32, NvsError, NvsImage } from "../src/storage/nvs";
import { TABLES } from "../src/tables";

const SIZE = TABLES.storage.size;

/** What a value lies as when it comes back from flash. */
const again = (image: NvsImage): NvsImage => new NvsImage(image.data);

it("keeps numbers and texts", () => {
  const image = NvsImage.blank(SIZE);
  image.set("wificnc", "p_sx", 4);
  image.set("wificnc", "wifi_ssid", "Küche");
  image.set("other", "p_sx", 9);
  const back = again(image);
  expect(back.get("wificnc", "p_sx")).toBe(4);
  expect(back.get("wificnc", "wifi_ssid")).toBe("Küche");
  expect(back.get("other", "p_sx")).toBe(9);
  expect(back.get("wificnc", "p_sy")).toBeUndefined();
  expect(back.keys("wificnc").sort()).toEqual(["p_sx", "wifi_ssid"]);
  expect(back.damaged).toEqual([]);
});

it("keeps numbers of 16 bits as such", () => {
  const image = NvsImage.blank(SIZE);
  image.set("wificnc", "io_dir", 0xff0a, 16);
  expect(again(image).get("wificnc", "io_dir")).toBe(0xff0a);
  const entry = 64 + 32; // behind the entry of the namespace
  expect([...image.data.slice(entry + 1, entry + 2), ...image.data.slice(entry + 24, entry + 26)]).toEqual([0x02, 0x0a, 0xff]);
});

it("has the newest value only, over as many writes as fit, and says when they do not", () => {
  const image = NvsImage.blank(SIZE);
  let n = 0;
  expect(() => {
    for (; n < 10_000; n++) image.set("wificnc", "counter", n % 256);
  }).toThrow(NvsError);
  // Five of the six pages, 126 entries each; one is the name of the namespace.
  expect(n).toBe(5 * 126 - 1);
  expect(again(image).get("wificnc", "counter")).toBe((n - 1) % 256);
});

it("forgets", () => {
  const image = NvsImage.blank(SIZE);
  image.set("wificnc", "wifi_pass", "12345678");
  image.remove("wificnc", "wifi_pass");
  expect(again(image).get("wificnc", "wifi_pass")).toBeUndefined();
});

it("leaves an entry out whose checksum is wrong", () => {
  const image = NvsImage.blank(SIZE);
  image.set("wificnc", "p_sx", 4);
  const data = image.data;
  data[64 + 32 + 24] = 5; // the value, behind the entry of the namespace
  expect(new NvsImage(data).get("wificnc", "p_sx")).toBeUndefined();
});

it("refuses what is no partition", () => {
  expect(() => new NvsImage(new Uint8Array(100))).toThrow(NvsError);
  expect(() => new NvsImage(new Uint8Array(SIZE).fill(0x55))).toThrow(/no page/);
});

/** zlib's crc32(b"123456789", 0xFFFFFFFF). */
it("computes the ROM's checksum", () => expect(crc32(new TextEncoder().encode("123456789"))).toBe(0xd202d277));
