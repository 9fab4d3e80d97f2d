"""What proves who has sent a packet: core/wire/seal.h."""

from __future__ import annotations

import hmac
import struct
from dataclasses import dataclass

from wificnc.connection.wmc3.layout import Seal

MASK = (1 << 64) - 1
PROVES, SEALS = b"WMC3 host proof\0", b"WMC3 datagrams\0\0"
MAC_SIZE = 8


def proof(secret: bytes, device_nonce: bytes, host_nonce: bytes) -> bytes:
    """That a host knows the secret."""
    return hmac.digest(secret, PROVES + device_nonce + host_nonce, "sha256")


@dataclass
class Sealer:
    """A host's session."""

    session: int
    key: bytes
    counter: int = 0

    @classmethod
    def derive(cls, session: int, secret: bytes, device_nonce: bytes, host_nonce: bytes) -> Sealer:
        return cls(session, hmac.digest(secret, SEALS + device_nonce + host_nonce, "sha256")[:16])

    def seal(self, packet: bytes) -> bytes:
        """The packet and its seal behind it."""
        self.counter += 1
        whole = packet + Seal(self.session, self.counter, bytes(MAC_SIZE)).pack()[:-MAC_SIZE]
        return whole + struct.pack("<Q", siphash(self.key, whole))


def siphash(key: bytes, data: bytes) -> int:
    """SipHash-1-3 (Aumasson, Bernstein 2012). Datagrams are short; a library would be one dependency more."""
    k0: int
    k1: int
    k0, k1 = struct.unpack("<QQ", key)
    v = [k0 ^ 0x736F6D6570736575, k1 ^ 0x646F72616E646F6D, k0 ^ 0x6C7967656E657261, k1 ^ 0x7465646279746573]
    padded = data + bytes(7 - len(data) % 8) + bytes([len(data) & 0xFF])
    words: tuple[int, ...] = struct.unpack(f"<{len(padded) // 8}Q", padded)
    for word in words:
        v[3] ^= word
        _turn(v, 1)
        v[0] ^= word
    v[2] ^= 0xFF
    _turn(v, 3)
    return v[0] ^ v[1] ^ v[2] ^ v[3]


def _turn(v: list[int], rounds: int) -> None:
    v0, v1, v2, v3 = v
    for _ in range(rounds):
        v0, v2 = v0 + v1 & MASK, v2 + v3 & MASK
        v1, v3 = (v1 << 13 | v1 >> 51) & MASK ^ v0, (v3 << 16 | v3 >> 48) & MASK ^ v2
        v0, v2 = (v0 << 32 | v0 >> 32) + v3 & MASK, v2 + v1 & MASK
        v1, v3 = (v1 << 17 | v1 >> 47) & MASK ^ v2, (v3 << 21 | v3 >> 43) & MASK ^ v0
        v2 = (v2 << 32 | v2 >> 32) & MASK
    v[:] = v0, v1, v2, v3
