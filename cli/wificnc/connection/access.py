"""The access key of a controller in a network: core/access/access.h."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets

LETTERS = "0123456789abcdefghjkmnpqrstvwxyz"  # Crockford's: none is like another
GROUPS, GROUP = 4, 5
KEY_MAX = 63  # bytes without dashes and spaces
KEY_VARIABLE = "WIFICNC_KEY"  # of the environment; arguments can be read by all
LABEL = b"WiFiCNC login\0\0\0"
# Fewer rounds let a rogue controller guess the key from the proof; six digits are some 0.1 s of a computer.
ROUNDS_MIN = 1000
QUESTION = re.compile(rb"\[LOGIN:([0-9a-f]{32}),([0-9a-f]{32}),([1-9]\d{3,5})\]")


def make_key() -> str:
    """100 random bits, as controllers make them."""
    return "-".join("".join(secrets.choice(LETTERS) for _ in range(GROUP)) for _ in range(GROUPS))


def normal_key(key: str) -> bytes:
    """The form in which keys are compared and digested: letter case of a to z, dashes and spaces do not count."""
    return key.encode().replace(b"-", b"").replace(b" ", b"").lower()


def key_secret(key: str, salt: bytes, rounds: int) -> bytes:
    """What proofs are made with."""
    return hashlib.pbkdf2_hmac("sha256", normal_key(key), salt, rounds)


def login_proof(key: str, said: bytes) -> bytes | None:
    """The answer to what a controller asks by `[LOGIN:nonce,salt,rounds]`; None: it asks nothing."""
    question = QUESTION.search(said)
    if question is None:
        return None
    nonce, salt, rounds = bytes.fromhex(question[1].decode()), bytes.fromhex(question[2].decode()), int(question[3])
    secret = key_secret(key, salt, rounds)
    return hmac.digest(secret, LABEL + nonce, "sha256").hex().encode()
