import { expect, it } from "vitest";
import { loginProof } from "../src/link/login";
import { trustedOf } from "../src/link/trust";

const ASKED = "[LOGIN:000102030405060708090a0b0c0d0e0f,6465666768696a6b6c6d6e6f70717273,2000]";

it("proves a key as the controller and the command line do", () => {
  // Python's hashlib.pbkdf2_hmac and hmac
  const proof = "a0bb29f8eace3e3fc4fc1be1233949770ae450e3d9f0afe8b6a0edefb87a846e";
  expect(loginProof("k7qf3-x2m9d-0abcd-efghj", ["[MSG:Locked]", ASKED])).toBe(proof);
  expect(loginProof("K7QF3X2M9D 0abcd efghj", [ASKED])).toBe(proof);
  expect(loginProof("k7qf3-x2m9d-0abcd-efghk", [ASKED])).not.toBe(proof);
});

it("proves nothing to who asks nothing, or for work without end", () => {
  for (const said of ["", "[MSG:LOGIN]", ASKED.replace("2000", "0"), ASKED.replace("2000", "99999999")]) {
    expect(loginProof("key", [said])).toBeNull();
  }
});

it("reads the list of trusted addresses", () => {
  const said = ["[MSG:x]", "[TRUST:1,192.168.1.20,always]", "[TRUST:3,2001:db8:1:2,86000]", "[TRUST:x]"];
  expect(trustedOf(said)).toEqual([
    { number: 1, address: "192.168.1.20", seconds: null },
    { number: 3, address: "2001:db8:1:2", seconds: 86000 },
  ]);
});
