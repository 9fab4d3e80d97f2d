import { hmac } from "@noble/hashes/hmac.js";
import { pbkdf2 } from "@noble/hashes/pbkdf2.js";
import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex, concatBytes, hexToBytes, utf8ToBytes } from "@noble/hashes/utils.js";

const LABEL = utf8ToBytes("WiFiCNC login\0\0\0");
const QUESTION = /^\[LOGIN:([0-9a-f]{32}),([0-9a-f]{32}),([1-9]\d{3,5})\]$/;

/** Letter case of A to Z, dashes and spaces do not count: core/access/key.c. */
function normalKey(key: string): Uint8Array {
  return utf8ToBytes(key.replace(/[- ]/g, "").replace(/[A-Z]/g, (letter) => letter.toLowerCase()));
}

/** What both sides make of the access key: it is never sent. */
export function keySecret(key: string, salt: string, rounds: number): Uint8Array {
  return pbkdf2(sha256, normalKey(key), hexToBytes(salt), { c: rounds, dkLen: 32 });
}

/**
 * The answer to what a controller asks by `[LOGIN:nonce,salt,rounds]`; null: it asks nothing. Without WebCrypto, which
 * browsers keep from pages of the local network.
 */
export function loginProof(key: string, said: readonly string[]): string | null {
  for (const line of said) {
    const [, nonce, salt, rounds] = QUESTION.exec(line) ?? [];
    if (nonce === undefined || salt === undefined) continue;
    return bytesToHex(hmac(sha256, keySecret(key, salt, Number(rounds)), concatBytes(LABEL, hexToBytes(nonce))));
  }
  return null;
}
