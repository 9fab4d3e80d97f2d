// A client of the binary protocol that shares nothing with ours: written from docs/protocol.md alone, with node's dgram,
// net and crypto. `node client.mjs DEVICE OWN_ADDRESS KEY FIRST-LAST,..` (decimal keys to read) does a bit of everything and prints as JSON how it went.
import { createHmac, pbkdf2Sync, randomBytes } from "node:crypto";
import { createSocket } from "node:dgram";
import { connect } from "node:net";

const [DEVICE, OWN, KEY, FIRST_AND_LAST] = process.argv.slice(2);
const UDP_PORT = 58427, STATUS_PORT = 58428, CONTROL_PORT = 58429;
const MAGIC = 0x574d4333, HEADER = 18, SEGMENT = 44;
const MOTION = 0x01, JOG = 0x02, JOG_STOP = 0x03, ESTOP = 0x04, RESET = 0x07, SEGMENTS = 0x0a;
const STATUS = 0x20, ACK = 0x24, STREAM_ACK = 0x25, REFUSED = 0x26;
const HANDSHAKE = 0x40, CONFIG_GET = 0x42, CONFIG_SET = 0x43, OPEN = 0x60, CLOSE = 0x62, CHALLENGE = 0x65, AUTHENTICATE = 0x67, AUTHENTICATED = 0x6c;
const CONFIG_SAVE = 0x45;
const U8 = 0, U16 = 1, FLOAT = 4, STRING = 5, LAST = 0x02;
const REPLY_MS = 100_000, RESEND_MS = 30, ASK_MS = 20;
const IDLE = 0, ESTOPPED = 7;

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
const bytes = (size, fill) => { const data = Buffer.alloc(size); fill(data); return data; };

// ---- packets ----

function crc(data) {
  let sum = 0xffff;
  for (const byte of data) {
    sum ^= byte << 8;
    for (let bit = 0; bit < 8; bit++) sum = ((sum << 1) ^ (sum & 0x8000 ? 0x1021 : 0)) & 0xffff;
  }
  return sum;
}

let sequence = 1000; // one count for both channels

function build(type, payload) {
  const packet = Buffer.concat([Buffer.alloc(HEADER), payload]);
  packet.writeUInt32LE(MAGIC, 0);
  packet[4] = 1;
  packet[5] = type;
  packet.writeUInt16LE(payload.length, 6);
  packet.writeUInt32LE(sequence++, 8);
  packet.writeUInt32LE(Number((process.hrtime.bigint() / 1000n) & 0xffffffffn), 12);
  packet.writeUInt16LE(crc(packet), 16);
  return packet;
}

function parse(data) {
  if (data.length < HEADER || data.readUInt32LE(0) !== MAGIC || data[4] !== 1) return null;
  const packet = Buffer.from(data.subarray(0, HEADER + data.readUInt16LE(6)));
  const sum = packet.readUInt16LE(16);
  packet.writeUInt16LE(0, 16);
  return crc(packet) === sum ? { type: packet[5], payload: packet.subarray(HEADER) } : null;
}

const segment = (steps, us, id, flags) => bytes(SEGMENT, (data) => {
  steps.forEach((count, axis) => data.writeInt32LE(count, 4 * axis));
  data.writeUInt32LE(us, 24);
  data.writeUInt16LE(id, 40);
  data[42] = flags;
});

// ---- TCP: a request, a reply ----

let waiting = [], unread = Buffer.alloc(0);
const tcp = connect({ port: CONTROL_PORT, host: DEVICE, localAddress: OWN }).setNoDelay(true);
await new Promise((done, failed) => tcp.once("connect", done).once("error", failed));
tcp.on("data", (data) => {
  unread = Buffer.concat([unread, data]);
  while (unread.length >= 2 && unread.length >= 2 + unread.readUInt16LE(0)) {
    const size = unread.readUInt16LE(0);
    waiting.shift()(parse(unread.subarray(2, 2 + size)));
    unread = unread.subarray(2 + size);
  }
});

async function request(type, payload = Buffer.alloc(0)) {
  const packet = build(type, payload);
  const reply = new Promise((done) => waiting.push(done));
  tcp.write(Buffer.concat([bytes(2, (size) => size.writeUInt16LE(packet.length)), packet]));
  const late = setTimeout(() => { throw new Error(`no reply to 0x${type.toString(16)}`); }, REPLY_MS);
  const { type: kind, payload: answer } = await reply;
  clearTimeout(late);
  return kind === REFUSED ? { refused: answer[5] } : { kind, answer };
}

const get = async (key) => (await request(CONFIG_GET, bytes(68, (data) => data.writeUInt16LE(key)))).answer;
const set = (key, type, fill) => request(CONFIG_SET, bytes(68, (data) => {
  data.writeUInt16LE(key, 0);
  data.writeUInt16LE(type, 2);
  fill(data.subarray(4));
}));

// ---- authentication: from now on a seal behind each datagram ----

let session = 0, sealKey = null, counter = 0;

async function authenticate(key) {
  const { answer } = await request(CHALLENGE);
  const nonces = Buffer.concat([answer.subarray(0, 16), randomBytes(16)]);
  const secret = pbkdf2Sync(key.toLowerCase().replace(/[- ]/g, ""), answer.subarray(16, 32), answer.readUInt32LE(32), 32, "sha256");
  const digest = (label) => createHmac("sha256", secret).update(label.padEnd(16, "\0")).update(nonces).digest();
  const reply = await request(AUTHENTICATE, Buffer.concat([nonces.subarray(16), digest("WMC3 host proof")]));
  if (reply.kind === AUTHENTICATED) [session, sealKey] = [reply.answer.readUInt32LE(0), digest("WMC3 datagrams").subarray(0, 16)];
  return reply;
}

function sipHash(key, data) {
  const left = (word, bits) => BigInt.asUintN(64, (word << bits) | (word >> (64n - bits)));
  const add = (one, other) => BigInt.asUintN(64, one + other);
  const [k0, k1] = [key.readBigUInt64LE(0), key.readBigUInt64LE(8)];
  let [a, b, c, d] = [k0 ^ 0x736f6d6570736575n, k1 ^ 0x646f72616e646f6dn, k0 ^ 0x6c7967656e657261n, k1 ^ 0x7465646279746573n];
  const rounds = (count) => {
    for (; count > 0; count--) {
      a = add(a, b); b = left(b, 13n) ^ a; a = left(a, 32n);
      c = add(c, d); d = left(d, 16n) ^ c;
      a = add(a, d); d = left(d, 21n) ^ a;
      c = add(c, b); b = left(b, 17n) ^ c; c = left(c, 32n);
    }
  };
  const padded = Buffer.concat([data, Buffer.alloc(7 - (data.length % 8)), Buffer.from([data.length & 0xff])]);
  for (let at = 0; at < padded.length; at += 8) {
    const word = padded.readBigUInt64LE(at);
    d ^= word; rounds(1); a ^= word;
  }
  c ^= 0xffn; rounds(3);
  return a ^ b ^ c ^ d;
}

function sealed(packet) {
  if (sealKey === null) return packet;
  const end = bytes(8, (data) => { data.writeUInt32LE(session, 0); data.writeUInt32LE(++counter, 4); });
  const whole = Buffer.concat([packet, end]);
  return Buffer.concat([whole, bytes(8, (data) => data.writeBigUInt64LE(sipHash(sealKey, whole), 0))]);
}

// ---- UDP: motion out, status in ----

const udp = createSocket("udp4"), listener = createSocket("udp4");
await Promise.all([new Promise((done) => udp.bind(0, OWN, done)), new Promise((done) => listener.bind(STATUS_PORT, OWN, done))]);
let status = null, onAck = () => {};
listener.on("message", (data) => {
  const packet = parse(data);
  if (packet?.type !== STATUS) return;
  const position = [0, 4, 8, 12, 16, 20].map((at) => packet.payload.readInt32LE(at));
  status = { position, state: packet.payload[28], alarm: packet.payload[29] };
});
udp.on("message", (data) => {
  const packet = parse(data);
  if (packet?.type === STREAM_ACK) onAck(packet.payload);
});
const send = (type, payload) => udp.send(sealed(build(type, payload)), UDP_PORT, DEVICE);

async function until(condition, what) {
  for (let tries = 0; !(status && condition(status)); tries++) {
    if (tries > 1000) throw new Error(`${what}: ${JSON.stringify(status)}`);
    await sleep(5);
  }
  return status;
}

/** Send numbered segments until all are executed. lost: this part of the datagrams never leaves. */
async function stream(segments, lost) {
  const opened = (await request(OPEN, Buffer.alloc(4))).answer;
  const id = opened.readUInt32LE(0), sent = new Map();
  let next = 0, limit = opened.readUInt16LE(4), done = 0, taken = Buffer.alloc(16), refusal = opened[6], dropped = 0;
  onAck = (ack) => {
    if (ack.readUInt32LE(0) !== id || ack.readUInt32LE(4) < next) return; // an older one
    next = ack.readUInt32LE(4);
    done = Math.max(done, ack.readUInt32LE(8));
    taken = Buffer.from(ack.subarray(12, 28));
    limit = Math.max(limit, next + ack.readUInt16LE(28));
    refusal = ack[31];
  };
  const isDue = (number, now) => {
    const bit = number - next;
    if (bit < 128 && (taken[bit >> 3] >> (bit & 7)) & 1) return false;
    return now - (sent.get(number) ?? 0) >= RESEND_MS;
  };
  const post = (first, some) => {
    const head = bytes(12, (data) => { data.writeUInt32LE(id, 0); data.writeUInt32LE(first, 4); data[8] = some.length; });
    if (Math.random() < lost) dropped++; else send(SEGMENTS, Buffer.concat([head, ...some]));
  };
  while (done < segments.length && refusal === 0) {
    const now = Date.now(), end = Math.min(limit, segments.length);
    for (let number = next; number < end; number++) {
      const first = number;
      while (number < end && number - first < 8 && isDue(number, now)) sent.set(number++, now);
      if (number > first) post(first, segments.slice(first, number--));
    }
    post(next, []);
    await sleep(ASK_MS);
  }
  const closed = await request(CLOSE, bytes(4, (data) => data.writeUInt32LE(id)));
  return { done, refusal, dropped, closed: closed.kind === ACK };
}

// ---- a bit of everything ----

const result = {};
const hello = (await request(HANDSHAKE, bytes(36, (data) => { data.writeUInt32LE(0x01000000); data.write("client.mjs", 4); }))).answer;
result.name = hello.subarray(12, 44).toString().replace(/\0+$/, "");
result.locked = (await set(0x0103, U16, (value) => value.writeUInt16LE(20))).refused;
result.authenticated = (await authenticate(KEY)).kind === AUTHENTICATED;
result.set = [
  (await set(0x0103, U16, (value) => value.writeUInt16LE(20))).kind === ACK,
  (await set(0x0001, FLOAT, (value) => value.writeFloatLE(200.5))).kind === ACK,
  (await set(0x0103, U16, (value) => value.writeUInt16LE(5))).refused,
];
result.read = [(await get(0x0103)).readUInt16LE(4), (await get(0x0001)).readFloatLE(4)];

// ---- every key of the board, as numbers or text by the type of the answer ----

const value = async (key) => {
  const answer = await get(key), at = answer.subarray(4);
  return [() => at[0], () => at.readUInt16LE(0), () => at.readUInt32LE(0), () => at.readInt32LE(0), () => at.readFloatLE(0),
    () => at.toString("utf8", 0, at.indexOf(0))][answer.readUInt16LE(2)]();
};
result.keys = {};
for (const range of FIRST_AND_LAST.split(",")) {
  const [first, last] = range.split("-").map(Number);
  for (let key = first; key <= last; key++) result.keys[key] = await value(key);
}
const pin = (key, number) => set(key, U8, (data) => { data[0] = number; });
const [step, probe] = [await value(0x0500), await value(0x0513)];
result.pins = [
  (await pin(0x0500, probe)).kind === ACK, (await pin(0x0513, step)).kind === ACK,
  (await request(CONFIG_SAVE)).kind === ACK, await value(0x0500) === probe,
  (await pin(0x0500, 255)).refused, (await pin(0x0530, 1)).refused,
];
result.network = [
  (await set(0x0200, STRING, (data) => data.write("shop"))).kind === ACK,
  (await set(0x0201, STRING, (data) => data.write("seven77"))).refused,
  (await set(0x0202, STRING, (data) => data.write("mill"))).kind === ACK,
  (await request(CONFIG_SAVE)).kind === ACK, await value(0x0200), await value(0x0201), await value(0x0202),
];

send(JOG_STOP, Buffer.from([0xff, 0, 0, 0]));
await until(() => true, "a status");
await request(JOG, bytes(8, (data) => { data[0] = 2; data.writeInt8(-1, 1); data.writeUInt32LE(1000, 4); }));
await until(({ position }) => position[2] < -50, "a jog");
await request(JOG_STOP, Buffer.from([0xff, 0, 0, 0]));
const begin = (await until(({ state }) => state === IDLE, "the end of the jog")).position;

const ways = Array.from({ length: 400 }, (_, n) => [Math.round(20 * Math.sin(n / 40)), Math.round(20 * Math.sin(n / 25)), 0, 0, 0, 0]);
result.stream = await stream(ways.map((steps, n) => segment(steps, 5000, n, n === ways.length - 1 ? LAST : 0)), 0.3);
const wanted = begin.map((at, axis) => ways.reduce((sum, steps) => sum + steps[axis], at));
result.exact = (await until(({ position }) => position.every((at, axis) => at === wanted[axis]), "the end of the stream")).state === IDLE;

for (let n = 0; n < 30; n++) {
  send(MOTION, Buffer.concat([Buffer.from([2, 0, 0, 0]), segment([5, 0, 0, 0, 0, 0], 5000, n, 0), segment([0, 5, 0, 0, 0, 0], 5000, n, n === 29 ? LAST : 0)]));
  await sleep(10);
}
await until(({ position }) => position[0] === wanted[0] + 150 && position[1] === wanted[1] + 150, "datagrams");

await request(ESTOP);
result.estop = (await until(({ state }) => state === ESTOPPED, "the e-stop")).alarm;
result.jog_in_estop = (await request(JOG, bytes(8, (data) => { data.writeInt8(1, 1); data.writeUInt32LE(100, 4); }))).refused;
await request(RESET);
await until(({ state }) => state === IDLE, "the reset");
process.stdout.write(JSON.stringify(result));
process.exit(0);
