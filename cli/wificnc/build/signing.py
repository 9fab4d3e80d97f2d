"""The key that signs firmware for updates over the network: the sender's side of targets/esp32/net/signature.h.

ECDSA with P-256 and SHA-256, as `openssl dgst -sha256 -verify` checks it. A firmware carries the public key of who has
built it, and takes only updates that are signed with it; over USB it is replaced by any other.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
    load_pem_public_key,
)

from wificnc.errors import BuildError

VARIABLE = "WIFICNC_SIGNING_KEY"  # a file, or the PEM text itself
ECDSA = ec.ECDSA(hashes.SHA256())
HALF = 32  # bytes of each of the two numbers of a signature
SHOWN = 16  # hexadecimal digits that tell keys apart


@dataclass(frozen=True)
class SigningKey:
    """The key of our own builds, or of a release."""

    public: ec.EllipticCurvePublicKey
    private: ec.EllipticCurvePrivateKey | None  # None: builds cannot be signed with it

    @property
    def point(self) -> bytes:
        """The public key as firmware has it: 04, X, Y."""
        return self.public.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)

    @property
    def name(self) -> str:
        return hashlib.sha256(self.point).hexdigest()[:SHOWN]

    def sign(self, image: bytes) -> bytes | None:
        """In DER, as openssl writes it. The same image and key have the same signature (RFC 6979)."""
        if self.private is None:
            return None
        return self.private.sign(image, ec.ECDSA(hashes.SHA256(), deterministic_signing=True))

    def has_signed(self, image: bytes, signature: bytes) -> bool:
        try:
            self.public.verify(signature, image, ECDSA)
        except InvalidSignature:
            return False
        return True


def default_path(environment: Mapping[str, str] = os.environ) -> Path:
    """Where our own key lies, of all checkouts of this user."""
    if os.name == "nt" and "APPDATA" in environment:
        return Path(environment["APPDATA"]) / "wificnc" / "signing-key.pem"
    return Path(environment.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "wificnc" / "signing-key.pem"


def signing_key(environment: Mapping[str, str] = os.environ) -> SigningKey:
    """That of WIFICNC_SIGNING_KEY, else our own, which is made when it is first needed. Raises BuildError."""
    given = environment.get(VARIABLE, "")
    if given.startswith("-----BEGIN"):
        return _read(given.encode(), VARIABLE)
    path = Path(given) if given else default_path(environment)
    if not given and not path.exists():
        _make(path)
    try:
        return _read(path.read_bytes(), str(path))
    except OSError as err:
        raise BuildError(f"cannot read the signing key {path}: {err.strerror or err}", hint=f"${VARIABLE}") from err


def _read(pem: bytes, where: str) -> SigningKey:
    """A private key, or a public one for those who build a release again. Raises BuildError."""
    private = None
    try:
        if b"PRIVATE KEY" in pem:
            private = load_pem_private_key(pem, None)
            public = private.public_key()
        else:
            public = load_pem_public_key(pem)
    except (ValueError, TypeError, UnsupportedAlgorithm) as err:
        raise BuildError(f"{where} is not a PEM key without a password", hint=MAKE_HINT) from err
    if not isinstance(public, ec.EllipticCurvePublicKey) or not isinstance(public.curve, ec.SECP256R1):
        raise BuildError(f"{where} is not a key of the curve P-256", hint=MAKE_HINT)
    return SigningKey(public, private if isinstance(private, ec.EllipticCurvePrivateKey) else None)


MAKE_HINT = "openssl ecparam -name prime256v1 -genkey -noout -out FILE makes one"


def _make(path: Path) -> None:
    """Raises BuildError."""
    pem = ec.generate_private_key(ec.SECP256R1()).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # for its owner alone from the first byte on, and never over one that another build has just made
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(pem)
    except FileExistsError:
        return
    except OSError as err:
        raise BuildError(f"cannot make the signing key {path}: {err.strerror or err}", hint=f"${VARIABLE}") from err


def raw_signature(der: bytes) -> bytes:
    """The two numbers of a signature, of HALF bytes each, as they are sent. Raises ValueError."""
    first, second = decode_dss_signature(der)
    try:
        return first.to_bytes(HALF, "big") + second.to_bytes(HALF, "big")
    except OverflowError as err:
        raise ValueError("not a signature of P-256") from err


def key_header_text(key: SigningKey) -> str:
    """The whole of signing_key.h."""
    rows = [", ".join(f"0x{byte:02X}" for byte in key.point[at : at + 13]) for at in range(0, len(key.point), 13)]
    return "\n".join(
        [
            "/* Generated by `wificnc dev signing-key`. Do not edit.",
            f" * Who has signed an update that this firmware takes: key {key.name}. A point of P-256: 04, X, Y. */",
            "#define SIGNING_KEY \\",
            "    " + ", \\\n    ".join(rows),
            "",
        ]
    )
