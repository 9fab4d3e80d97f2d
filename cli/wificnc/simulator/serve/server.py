"""One serving controller: a process, its addresses, and what it tells of its clients."""

from __future__ import annotations

import ctypes
import errno
import os
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from wificnc.build.checkout import checkout_root
from wificnc.build.host import SYSTEM, build_program, ensure_host_library, variant_directory
from wificnc.build.native import carried_server, server_name
from wificnc.connection.access import KEY_VARIABLE
from wificnc.errors import ServeError
from wificnc.simulator.serve.options import ServeOptions, program_arguments
from wificnc.simulator.serve.store_file import store_failure

END_SECONDS = 5.0


@dataclass(frozen=True)
class ClientEvent:
    """A client was "connected", became "owner", was "disconnected", ..."""

    what: str
    who: str


def serve_program(variant: str = "release") -> Path:
    """The program: the wheel's, or built when stale. Raises BuildError."""
    if variant == "release" and (carried := carried_server()):
        return carried
    root = checkout_root()
    source = root / "targets" / "pc" / "main.c"
    return build_program([source], variant_directory(root, variant) / server_name(SYSTEM), variant)


class Server:
    """A controller that serves from `with` until it ends.

    Raises:
        ServeError: on entry, when a door cannot be opened or a setting is refused.
    """

    def __init__(self, options: ServeOptions, variant: str = "release") -> None:
        self.options = options
        self.tcp: str | None = None
        self.control: str | None = None
        self.wmc3: str | None = None
        self.pendant: str | None = None  # address or device
        self.device: Path | None = None  # what the link of the pty leads to
        self._program = serve_program(variant)

    def __enter__(self) -> Server:
        argv = [str(self._program), *program_arguments(self.options)]
        pipe = subprocess.PIPE
        environment = {**os.environ, KEY_VARIABLE: self.options.key}  # arguments can be read by all
        self._process = subprocess.Popen(
            argv, stdin=pipe, stdout=pipe, text=True, encoding="utf-8", errors="replace", env=environment
        )
        try:
            self._wait_until_ready()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        return self._process.pid

    def events(self) -> Iterator[ClientEvent]:
        """What happens to its clients, as it happens; ends with the server."""
        for line in self._lines():
            if line[0] == "client" and len(line) == 3:
                yield ClientEvent(line[1], line[2])

    def stop(self) -> int:
        """End it; its exit code. It ends with its stdin (--parent), which all systems have; not all have signals."""
        process = self._process
        with suppress(OSError):
            if process.stdin:
                process.stdin.close()
        try:
            code = process.wait(END_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
        if process.stdout:
            process.stdout.close()
        return code

    def _lines(self) -> Iterator[list[str]]:
        assert self._process.stdout
        for line in self._process.stdout:
            yield line.rstrip("\n").split("\t")

    def _wait_until_ready(self) -> None:
        for line in self._lines():
            if line == ["ready"]:
                return
            if line[0] == "tcp":
                self.tcp = line[1]
            elif line[0] == "wmc3":
                self.wmc3 = line[1]
            elif line[0] == "control":
                self.control = line[1]
            elif line[0] == "pendant":
                self.pendant = line[1]
            elif line[0] == "pty":
                self.device = Path(line[1])
            elif line[0] == "failed":
                raise _failure(self.options, line[1], int(line[2]), line[3])
        raise ServeError(f"{self._program.name} ended with {self._process.wait()} before it was ready")


def _failure(options: ServeOptions, stage: str, error: int, text: str) -> ServeError:
    """The program's short words as ours."""
    if stage == "tcp":
        return _tcp_failure(options, error, text)
    if stage == "control":
        return ServeError(f"--control {options.control}: {text}", hint="0 takes any free port")
    if stage == "wmc3":
        return _wmc3_failure(options, error, text)
    if stage == "pty":
        return _pty_failure(options, error, text)
    if stage == "bus":
        return ServeError(f"--spindle-bus {options.spindle_bus}: {text}", hint="a serial port, such as /dev/ttyUSB0")
    if stage == "pendant":
        return ServeError(
            f"--pendant {options.pendant}: {text}",
            hint="a serial port with the board file's baud rate, a new name after pty:, or a free port after tcp:",
        )
    if stage == "setting":
        said = f"error:{error} {status_text(error)}" if error > 0 else "no answer"
        return ServeError(f"the controller refuses {text}: {said}")
    if stage == "store":
        return store_failure(options.store or Path(), error)
    return ServeError(f"the controller cannot be served: {stage}: {text}")


def _tcp_failure(options: ServeOptions, error: int, text: str) -> ServeError:
    free = "--tcp 127.0.0.1:0 takes any free port"
    if error == 0:
        return ServeError(f"--tcp {options.tcp}: host not found", hint=free)
    if error == errno.EADDRINUSE:
        return ServeError(
            f"port {options.tcp} is in use", hint=f"check for another `wificnc serve`, or choose another port: {free}"
        )
    return ServeError(f"cannot listen at {options.tcp}: {text}", hint=free)


def _wmc3_failure(options: ServeOptions, error: int, text: str) -> ServeError:
    if error == errno.EADDRINUSE:
        return ServeError(
            f"the ports of the binary protocol are in use at {options.wmc3}",
            hint="they are fixed; another device on this computer needs another address, like --wmc3 127.0.0.2",
        )
    return ServeError(f"--wmc3 {options.wmc3}: {text}", hint="use an address of this computer")


def _pty_failure(options: ServeOptions, error: int, text: str) -> ServeError:
    if error == errno.EEXIST:
        return ServeError(
            f"--pty {options.pty}: the name already exists and is not replaced",
            hint="choose a new name, like --pty ttyWiFiCNC",
        )
    if error == errno.ENOTSUP:
        return ServeError(f"--pty {options.pty}: {text}")
    return ServeError(f"--pty {options.pty}: {text}", hint="check that the folder exists and is writable")


def no_pty() -> str:
    """Why this system has no pseudo-terminals, in the words of the C program; "" where it has them."""
    text = ctypes.c_char_p.in_dll(ctypes.CDLL(str(ensure_host_library())), "net_pty_missing").value
    return (text or b"").decode()


def status_text(code: int) -> str:
    """The meaning of error:N in the controller's own words."""
    function = ctypes.CDLL(str(ensure_host_library())).status_text
    function.restype = ctypes.c_char_p
    text: bytes = function(code)
    return text.decode()
