"""The key that signs made-up firmware in tests, and in all that they start: never one of the user's."""

from __future__ import annotations

import os

from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from wificnc.build.signing import VARIABLE


def pem(number: int) -> str:
    """Always the same key for a number, as PEM."""
    private = ec.derive_private_key(number, ec.SECP256R1())
    return private.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()).decode()


def use_made_key() -> None:
    os.environ[VARIABLE] = pem(20)
