/**
 * NVS partition images (ESP-IDF, "NVS Partition Structure"): read, and change single keys the way the chip does it: the
 * old entry is marked erased, the new one is written behind the last. What we do not know stays as it lies there.
 *
 *   page, 4096 bytes   state u32 | sequence u32 | version u8 | 19 unused | crc32 u32        of bytes 4..27
 *                      32 bytes: 2 bits an entry: 11 empty, 10 written, 00 erased
 *                      126 entries of 32 bytes
 *   entry              namespace u8 | type u8 | span u8 | chunk u8 | crc32 u32 | key 16 | data 8
 *                      texts: size u16 | - | crc32 u32, then span - 1 entries of bytes
 */
import { t } from "../words";


const PAGE = 4096;
const ENTRY = 32;
const ENTRIES = 126;
const BITMAP_AT = 32;
const ENTRIES_AT = 64;
const VERSION_2 = 0xfe;
const STATE_EMPTY = 0xffffffff;
const STATE_ACTIVE = 0xfffffffe;
const STATE_FULL = 0xfffffffc;
const WRITTEN = 0b10;
const ERASED = 0b00;
const TYPE_U8 = 0x01;
const TYPE_U16 = 0x02;
const TYPE_TEXT = 0x21;
const ANY_CHUNK = 0xff;
/** The namespace of the names of namespaces. */
const NAMESPACES = 0;

export type StoredValue = number | string;

export class NvsError extends Error {}

/** Types whose data holds a number: bytes, signed. */
const NUMBERS: Record<number, [number, boolean]> = {
  0x01: [1, false],
  0x11: [1, true],
  0x02: [2, false],
  0x12: [2, true],
  0x04: [4, false],
  0x14: [4, true],
};

interface Place {
  page: number;
  index: number;
  span: number;
  type: number;
  namespace: number;
  key: string;
}

export class NvsImage {
  /** Damage found, in words; what was damaged is left out. */
  readonly damaged: string[] = [];
  private readonly bytes: Uint8Array<ArrayBuffer>;
  private readonly view: DataView;

  /** A copy of a partition. Throws NvsError when it is none. */
  constructor(data: Uint8Array) {
    if (data.length < 3 * PAGE || data.length % PAGE !== 0)
      throw new NvsError(t`${data.length} bytes are not an NVS partition: it has three or more pages of ${PAGE} bytes`);
    this.bytes = new Uint8Array(data);
    this.view = new DataView(this.bytes.buffer);
    const used = this.usedPages();
    if (used.length === 0 && this.bytes.some((byte) => byte !== 0xff))
      throw new NvsError(t`not an NVS partition: no page has a valid header`);
  }

  /** A partition that holds nothing. */
  static blank(size: number): NvsImage {
    return new NvsImage(new Uint8Array(size).fill(0xff));
  }

  get data(): Uint8Array<ArrayBuffer> {
    return this.bytes.slice();
  }

  /** A number or text; undefined: nothing is stored under this key. */
  get(namespace: string, key: string): StoredValue | undefined {
    const place = this.find(namespace, key);
    return place && this.value(place);
  }

  /** Store a text, or a number of so many bits. Throws NvsError when there is no room. */
  set(namespace: string, key: string, value: StoredValue, bits: 8 | 16 = 8): void {
    if (key.length > 15) throw new NvsError(t`${key} is longer than 15 characters`);
    if (this.get(namespace, key) === value) return;
    const number = this.namespaceNumber(namespace) ?? this.addNamespace(namespace);
    const old = this.find(namespace, key);
    this.append(number, key, value, bits);
    if (old) this.erase(old);
  }

  /** Forget a key. */
  remove(namespace: string, key: string): void {
    const place = this.find(namespace, key);
    if (place) this.erase(place);
  }

  /** Every key of a namespace with a number or a text. */
  keys(namespace: string): string[] {
    const number = this.namespaceNumber(namespace);
    return this.places()
      .filter((place) => place.namespace === number && (place.type in NUMBERS || place.type === TYPE_TEXT))
      .map((place) => place.key);
  }

  // ---- reading ----

  /** Pages in use, oldest first. */
  private usedPages(): number[] {
    const pages: { page: number; sequence: number }[] = [];
    for (let page = 0; page < this.bytes.length / PAGE; page++) {
      const state = this.view.getUint32(page * PAGE, true);
      if (state === STATE_EMPTY || state === 0) continue;
      if (this.view.getUint32(page * PAGE + 28, true) !== crc32(this.slice(page * PAGE + 4, 24))) {
        this.damaged.push(t`page ${page} has a damaged header`);
        continue;
      }
      if (this.bytes[page * PAGE + 8]! < VERSION_2) throw new NvsError(t`this NVS has a newer layout than this page supports`);
      pages.push({ page, sequence: this.view.getUint32(page * PAGE + 4, true) });
    }
    return pages.sort((a, b) => a.sequence - b.sequence).map((entry) => entry.page);
  }

  private places(): Place[] {
    return this.usedPages().flatMap((page) => this.placesOf(page));
  }

  private placesOf(page: number): Place[] {
    const found: Place[] = [];
    for (let index = 0; index < ENTRIES; ) {
      const at = this.at(page, index);
      const span = Math.max(1, this.bytes[at + 2]!);
      if (this.bits(page, index) !== WRITTEN) {
        index++;
        continue;
      }
      const head = new Uint8Array([...this.slice(at, 4), ...this.slice(at + 8, 24)]);
      if (this.view.getUint32(at + 4, true) !== crc32(head) || index + span > ENTRIES) {
        index++;
        continue;
      }
      const key = new TextDecoder("latin1").decode(this.slice(at + 8, 16)).replace(/\0.*$/s, "");
      found.push({ page, index, span, type: this.bytes[at + 1]!, namespace: this.bytes[at]!, key });
      index += span;
    }
    return found;
  }

  private find(namespace: string, key: string): Place | undefined {
    const number = this.namespaceNumber(namespace);
    if (number === undefined) return undefined;
    return this.places().findLast((place) => place.namespace === number && place.key === key);
  }

  private namespaceNumber(name: string): number | undefined {
    const place = this.places().find((entry) => entry.namespace === NAMESPACES && entry.key === name);
    return place && this.bytes[this.at(place.page, place.index) + 24];
  }

  private value(place: Place): StoredValue | undefined {
    const at = this.at(place.page, place.index);
    if (place.type === TYPE_TEXT) {
      const size = this.view.getUint16(at + 24, true);
      const text = this.slice(at + ENTRY, size);
      if (this.view.getUint32(at + 28, true) !== crc32(text)) return undefined;
      return new TextDecoder().decode(text).replace(/\0$/, "");
    }
    const number = NUMBERS[place.type];
    if (!number) return undefined;
    const [size, signed] = number;
    if (size === 1) return signed ? this.view.getInt8(at + 24) : this.bytes[at + 24]!;
    if (size === 2) return signed ? this.view.getInt16(at + 24, true) : this.view.getUint16(at + 24, true);
    return signed ? this.view.getInt32(at + 24, true) : this.view.getUint32(at + 24, true);
  }

  // ---- writing ----

  private append(namespace: number, key: string, value: StoredValue, bits: 8 | 16): void {
    const text = typeof value === "string" ? new TextEncoder().encode(`${value}\0`) : new Uint8Array();
    const span = 1 + Math.ceil(text.length / ENTRY);
    const { page, index } = this.room(span);
    const at = this.at(page, index);
    this.bytes.fill(0xff, at, at + span * ENTRY);
    const type = typeof value === "string" ? TYPE_TEXT : bits === 16 ? TYPE_U16 : TYPE_U8;
    this.bytes.set([namespace, type, span, ANY_CHUNK], at);
    this.bytes.fill(0, at + 8, at + 24);
    this.bytes.set(new TextEncoder().encode(key), at + 8);
    if (typeof value === "string") {
      this.view.setUint16(at + 24, text.length, true);
      this.view.setUint32(at + 28, crc32(text), true);
      this.bytes.set(text, at + ENTRY);
    } else if (bits === 16) {
      this.view.setUint16(at + 24, value, true);
    } else {
      this.bytes[at + 24] = value;
    }
    const head = new Uint8Array([...this.slice(at, 4), ...this.slice(at + 8, 24)]);
    this.view.setUint32(at + 4, crc32(head), true);
    for (let i = 0; i < span; i++) this.mark(page, index + i, WRITTEN);
  }

  private addNamespace(name: string): number {
    const taken = this.places()
      .filter((place) => place.namespace === NAMESPACES)
      .map((place) => this.bytes[this.at(place.page, place.index) + 24]!);
    const number = Math.max(0, ...taken) + 1;
    this.append(NAMESPACES, name, number, 8);
    return number;
  }

  /** Behind the last entry of the page that is written; else at the begin of an empty one. One page stays empty. */
  private room(span: number): { page: number; index: number } {
    const used = this.usedPages();
    const active = used.find((page) => this.view.getUint32(page * PAGE, true) === STATE_ACTIVE);
    if (active !== undefined) {
      let index = ENTRIES;
      while (index > 0 && this.bits(active, index - 1) === 0b11) index--;
      if (index + span <= ENTRIES) return { page: active, index };
      this.view.setUint32(active * PAGE, STATE_FULL, true);
    }
    const pages = [...Array(this.bytes.length / PAGE).keys()];
    const empty = pages.filter((page) => this.view.getUint32(page * PAGE, true) === STATE_EMPTY);
    if (empty.length < 2) throw new NvsError(t`the board's storage is full`);
    const last = used[used.length - 1];
    const sequence = last === undefined ? 0 : this.view.getUint32(last * PAGE + 4, true) + 1;
    return { page: this.begin(empty[0]!, sequence), index: 0 };
  }

  private begin(page: number, sequence: number): number {
    const at = page * PAGE;
    this.bytes.fill(0xff, at, at + PAGE);
    this.view.setUint32(at, STATE_ACTIVE, true);
    this.view.setUint32(at + 4, sequence, true);
    this.bytes[at + 8] = VERSION_2;
    this.view.setUint32(at + 28, crc32(this.slice(at + 4, 24)), true);
    return page;
  }

  private erase(place: Place): void {
    for (let i = 0; i < place.span; i++) this.mark(place.page, place.index + i, ERASED);
  }

  private mark(page: number, index: number, bits: number): void {
    const at = page * PAGE + BITMAP_AT + (index >> 2);
    const shift = 2 * (index % 4);
    this.bytes[at] = (this.bytes[at]! & ~(0b11 << shift)) | (bits << shift);
  }

  private bits(page: number, index: number): number {
    return (this.bytes[page * PAGE + BITMAP_AT + (index >> 2)]! >> (2 * (index % 4))) & 0b11;
  }

  private at(page: number, index: number): number {
    return page * PAGE + ENTRIES_AT + index * ENTRY;
  }

  private slice(at: number, size: number): Uint8Array {
    return this.bytes.subarray(at, at + size);
  }
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let crc = n;
  for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

/** As the chip's ROM computes it: CRC-32 begun at 0xFFFFFFFF instead of 0. */
export function crc32(data: Uint8Array): number {
  let crc = 0;
  for (const byte of data) crc = CRC_TABLE[(crc ^ byte) & 0xff]! ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}
