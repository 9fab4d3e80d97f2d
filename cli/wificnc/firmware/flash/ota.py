"""Updates over the network: the sender's side of targets/esp32/net/ota.h."""

from __future__ import annotations

import hashlib
import hmac
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass

from wificnc.connection.access import key_secret
from wificnc.errors import FlashError

PORT = 58430
CONNECT_S = 5.0
ANSWER_S = 20.0  # a sector is erased meanwhile
CHUNK = 16384
DIGEST_AT, DIGEST_DIGITS = 176, 16  # app_elf_sha256 of esp_app_desc_t, in an image
STATES = ("kept", "trial")
CONFIRM = "confirm"
BUSY, BUSY_S, AGAIN_S = "another upload", 12.0, 0.5
REFUSAL_HINTS = {
    "access key": "`wificnc wifi status` shows it, over USB",
    "for the board": "flash the firmware of its own board, or give --other-board if this is meant",
    "not signed": "an update comes from who has built the firmware that runs: docs/security.md#updates",
    "on trial": "run the same command again in half a minute",
    BUSY: "run the same command again when that one has ended",
    "another sender": "run the same command again: your key was not proved in time",
}
AGAIN_HINT = "the old firmware still runs; run the same command again"


@dataclass(frozen=True)
class Hello:
    """What a controller says first."""

    board: str
    nonce: str
    salt: str
    rounds: int
    digest: str = ""  # of the firmware that runs; "": an older one, which does not report it
    on_trial: bool = False


@dataclass(frozen=True)
class Signed:
    """A firmware, and who vouches for it."""

    data: bytes
    signature: bytes  # 64 bytes: build/signing.py

    @property
    def digest(self) -> str:
        """As the controller reports that of the firmware that runs: the first digits of the SHA-256 of its ELF file."""
        return self.data[DIGEST_AT : DIGEST_AT + DIGEST_DIGITS // 2].hex()


def greeted(host: str, port: int) -> tuple[Upload, Hello]:
    """A connection, and what the controller says first. Raises FlashError.

    Someone without the key holds the place for ten seconds at most.
    """
    deadline = time.monotonic() + BUSY_S
    while True:
        upload = Upload(host, port)
        try:
            return upload, upload.hello()
        except FlashError as err:
            upload.close()
            if BUSY not in err.message or time.monotonic() >= deadline:
                raise
        time.sleep(AGAIN_S)


def proof(key: str, hello: Hello, request: str) -> str:
    """HMAC-SHA256 of what will be sent, under the secret of the access key."""
    secret = key_secret(key, bytes.fromhex(hello.salt), hello.rounds)
    return hmac.new(secret, f"{hello.nonce} {request}".encode(), hashlib.sha256).hexdigest()


class Upload:
    """A connection to a controller that takes updates. Raises FlashError from every method."""

    def __init__(self, host: str, port: int = PORT) -> None:
        self.name = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), CONNECT_S)
        except OSError as err:
            raise FlashError(
                f"cannot reach {self.name}: {err.strerror or err}",
                hint="check that it is on and on this network; `wificnc discover` searches for it",
            ) from err
        self._socket.settimeout(ANSWER_S)
        self._said = b""

    def hello(self) -> Hello:
        words = self._line().split(" ")
        _, *runs = words[5:] or [""]
        known = len(words) >= 6 and words[:2] == ["WIFICNC-OTA", "3"] and words[5].isdecimal()
        if not known or (runs and (len(runs) != 2 or runs[1] not in STATES)):
            self._raise_error(" ".join(words))
            raise FlashError(f"{self.name} does not support the updates of this version")
        digest, state = runs or ("", "kept")
        return Hello(words[2], words[3], words[4], int(words[5]), digest, state == "trial")

    def confirm(self, hello: Hello, key: str) -> None:
        """The firmware that runs is reached by someone who knows the key: it can be kept."""
        self._put(f"{CONFIRM} {proof(key, hello, CONFIRM)}\n".encode())
        self._expect("OK")

    def send(
        self, hello: Hello, image: Signed, key: str, progress: Callable[[int, int], None], other_board: bool = False
    ) -> None:
        """Send the image and wait until the controller has checked it. @param other_board  it may be for another one"""
        data = image.data
        request = f"{len(data)} {hashlib.sha256(data).hexdigest()} {image.signature.hex()}{' any-board' * other_board}"
        self._put(f"{request} {proof(key, hello, request)}\n".encode())
        self._expect("OK")
        for at in range(0, len(data), CHUNK):
            self._put(data[at : at + CHUNK])
            progress(min(at + CHUNK, len(data)), len(data))
        while (line := self._line()).startswith("AT "):
            pass
        self._check(line, "DONE")

    def close(self) -> None:
        self._socket.close()

    def _put(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as err:
            self._raise_last_words()
            raise FlashError(f"the link to {self.name} is lost: {err.strerror or err}", AGAIN_HINT) from err

    def _line(self) -> str:
        while b"\n" not in self._said:
            try:
                piece = self._socket.recv(4096)
            except OSError as err:
                raise FlashError(f"{self.name} has stopped answering: {err.strerror or err}", AGAIN_HINT) from err
            if not piece:
                raise FlashError(f"{self.name} closed the connection", AGAIN_HINT)
            self._said += piece
        line, _, self._said = self._said.partition(b"\n")
        return line.decode("utf-8", "replace")

    def _raise_last_words(self) -> None:
        """Why it hung up, if it said so."""
        try:
            while True:
                self._raise_error(self._line())
        except FlashError as err:
            if err.message.startswith(f"{self.name} refuses"):
                raise

    def _expect(self, word: str) -> None:
        self._check(self._line(), word)

    def _check(self, line: str, word: str) -> None:
        self._raise_error(line)
        if line != word:
            raise FlashError(f"{self.name} answers {line!r}, not {word}", AGAIN_HINT)

    def _raise_error(self, line: str) -> None:
        if line.startswith("ERROR "):
            reason = line.removeprefix("ERROR ")
            hint = next((hint for word, hint in REFUSAL_HINTS.items() if word in reason), None)
            raise FlashError(f"{self.name} refuses: {reason}", hint)
