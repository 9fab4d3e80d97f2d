"""The network of `wificnc serve --on-chip`: which one a chip is in, and what of this computer leads to it."""

from __future__ import annotations

import re

from wificnc.board.model import Board
from wificnc.connection.port import BOARD_PORT
from wificnc.connection.wmc3.layout import CONTROL_PORT, UDP_PORT
from wificnc.errors import ServeError
from wificnc.firmware.flash.ota import PORT as UPDATE_PORT
from wificnc.simulator.serve.options import Address, ServeOptions

from wificnc_chips.cable import Cable, Network, Socketed
from wificnc_chips.slirp import PACKAGE_HINT, UserNetwork, has_slirp
from wificnc_chips.tap import TapNetwork

PAGE_PORT = 80  # targets/esp32/main/online.c
USER, OFF, TAP = "user", "off", "tap:"
ADDRESS = re.compile(rb"\[MSG:Address (\d+(?:\.\d+){3}) or")  # of firmware_tell_address()


def network_kind(options: ServeOptions) -> str:
    """user, off, or tap:NAME. Raises ServeError where there is no Ethernet, and an option needs it."""
    asked = options.network
    if options.board.ethernet is None:
        if asked not in (None, OFF):
            raise ServeError(f"--network {asked}: board {options.board.id} has no [ethernet] in its board file")
        kind = OFF
    else:
        kind = asked or (USER if has_slirp() else OFF)
    if kind not in (USER, OFF) and not kind.startswith(TAP):
        raise ServeError(f"--network {kind!r} is not a network", hint="user, tap:NAME or off")
    if kind == USER and options.http_names:
        raise ServeError("--http-name is of pages that this computer serves", hint="wificnc nvs build --http-name")
    if kind != USER and options.wmc3:
        raise ServeError("--wmc3 needs the image's Ethernet, which is not there", hint=why_off(options.board, kind))
    return kind


def why_off(board: Board, kind: str) -> str:
    """What to do for one."""
    if board.ethernet is None:
        return f"board {board.id} has no [ethernet] in its board file: the image has a serial port only"
    if kind != OFF:
        return "the image has its own address in that network: name it to the programs that connect"
    return "--network user" if has_slirp() else f"libslirp is not installed. {PACKAGE_HINT}"


class Ethernet:
    """A chip with a cable in a network, until close(). With libslirp, ports of this computer lead to the image's own
    servers. Raises ServeError where one cannot be opened."""

    def __init__(self, chip: Socketed, kind: str, options: ServeOptions) -> None:
        self.tcp: str | None = None
        self.page: str | None = None
        self.wmc3: str | None = None
        self.address: str | None = None  # that the image has printed
        self._said = b""
        network: Network = TapNetwork(kind.removeprefix(TAP)) if kind.startswith(TAP) else UserNetwork()
        self._cable = Cable(chip, network)
        self.plug, self.carry, self.close = self._cable.plug, self._cable.carry, self._cable.close
        try:
            if isinstance(network, UserNetwork):
                self._forward(network, options)
        except BaseException:
            self.close()
            raise

    def _forward(self, network: UserNetwork, options: ServeOptions) -> None:
        def at(address: Address, port: int) -> str:
            return str(Address(address.host, network.forward(address.host, address.port, port)))

        if options.tcp:
            self.tcp = at(options.tcp, BOARD_PORT)
        if options.http:
            self.page = f"http://{at(options.http, PAGE_PORT)}/"
        if options.wmc3:
            network.forward(options.wmc3, UDP_PORT, UDP_PORT, udp=True)
            for port in (CONTROL_PORT, UPDATE_PORT):
                network.forward(options.wmc3, port, port)
            self.wmc3 = options.wmc3

    @property
    def lost(self) -> int:
        """Frames that the chip did not take."""
        return self._cable.lost

    def hear(self, said: bytes) -> str | None:
        """What the image prints at its serial port. @return the address that it has now, when that is new"""
        self._said = (self._said + said)[-200:]
        found = list(ADDRESS.finditer(self._said))
        address = found[-1][1].decode() if found else self.address
        if address == self.address:
            return None
        self.address = address
        return address
