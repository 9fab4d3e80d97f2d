"""Updates over the network: the sender's side of targets/esp32/net/ota.h."""

from __future__ import annotations

import hashlib
import hmac
import socket
from collections.abc import Callable
from dataclasses import dataclass

from wificnc.errors import FlashError
from wificnc.link.access import key_secret

PORT = 58430
CONNECT_S = 5.0
ANSWER_S = 20.0  # a sector is erased meanwhile
CHUNK = 16384
REFUSAL_HINTS = {
    "access key": "`wificnc wifi status` shows it, over USB",
    "for the board": "flash the firmware of its own board, or give --other-board if this is meant",
    "not signed": "an update comes from who has built the firmware that runs: docs/security.md#updates",
}
AGAIN_HINT = "the old firmware still runs; run the same command again"


@dataclass(frozen=True)
class Hello:
    """What a controller says first."""

    board: str
    nonce: str
    salt: str
    rounds: int


@dataclass(frozen=True)
class Signed:
    """A firmware, and who vouches for it."""

    data: bytes
    signature: bytes  # 64 bytes: build/signing.py


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
        if len(words) != 6 or words[:2] != ["WIFICNC-OTA", "3"] or not words[5].isdecimal():
            self._raise_error(" ".join(words))
            raise FlashError(f"{self.name} does not support the updates of this version")
        return Hello(words[2], words[3], words[4], int(words[5]))

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
