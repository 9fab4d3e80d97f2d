"""The access key of a controller in a network: core/access/access.h."""

from __future__ import annotations

import hashlib
import secrets

LETTERS = "0123456789abcdefghjkmnpqrstvwxyz"  # Crockford's: none is like another
GROUPS, GROUP = 4, 5


def make_key() -> str:
    """100 random bits, as controllers make them."""
    return "-".join("".join(secrets.choice(LETTERS) for _ in range(GROUP)) for _ in range(GROUPS))


def normal_key(key: str) -> bytes:
    """The form in which keys are compared and digested: letter case of a to z, dashes and spaces do not count."""
    return key.encode().replace(b"-", b"").replace(b" ", b"").lower()


def key_secret(key: str, salt: bytes, rounds: int) -> bytes:
    """What proofs are made with."""
    return hashlib.pbkdf2_hmac("sha256", normal_key(key), salt, rounds)
