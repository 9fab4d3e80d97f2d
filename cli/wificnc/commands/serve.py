"""`wificnc serve`: be a controller in real time."""

from __future__ import annotations

import ipaddress
import signal
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import rich_click as click
from rich.markup import escape

from wificnc import __version__, ui
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.commands._chip import chip_image, on_chip_option, require_chips
from wificnc.commands._secret import ASKED, Secret
from wificnc.connection.access import KEY_MAX, make_key, normal_key
from wificnc.errors import ServeError, UserError
from wificnc.profile import Machine, load_machine
from wificnc.simulator.run import check_axes, parse_setting
from wificnc.simulator.serve.options import (
    DEFAULT_HTTP_PORT,
    DEFAULT_TCP,
    Address,
    ServeOptions,
    end_switches,
    parse_address,
    parse_host_name,
    parse_pendant,
    parse_speed,
    parse_wmc3,
)
from wificnc.simulator.serve.page import About, PageServer, page_folder
from wificnc.simulator.serve.server import ClientEvent, Server

if TYPE_CHECKING:
    from wificnc_chips import ChipServer

NOWHERE = Address("127.0.0.1", 0)  # of the controller, when only the page is to be found


@click.command()
@click.option("--tcp", default=DEFAULT_TCP, show_default=True, metavar="HOST:PORT", help="Where TCP listens, or off.")
@click.option("--http", metavar="HOST:PORT", help="Serve the web page: console, settings, jobs. docs/web.md.")
@click.option(
    "--http-name",
    "http_names",
    multiple=True,
    metavar="NAME",
    help="A name of your network that leads to the page, such as shop.lan; repeatable.",
)
@click.option(
    "--pty", type=click.Path(path_type=Path), metavar="LINK", help="Create a serial port of this name, for senders."
)
@click.option(
    "--spindle-bus",
    type=click.Path(path_type=Path),
    metavar="PORT",
    help="Serial port of a spindle drive ($395): docs/spindles.md. Without it the drive is simulated, too.",
)
@click.option(
    "--pendant",
    metavar="PORT",
    help="Port of a pendant: a serial port, pty:LINK or tcp:PORT; [pendant] of the board file. docs/pendant.md.",
)
@click.option("--wmc3", metavar="ADDRESS", help="IPv4 address for the binary protocol: docs/protocol.md.")
@click.option(
    "--io-module", is_flag=True, help="Simulate an I/O expansion module, with --wmc3 only; its inputs: --control."
)
@click.option(
    "--key",
    envvar="WIFICNC_KEY",
    show_envvar=True,
    default="",
    type=Secret(),
    help="Access key of network clients: $LOGIN=key. Made where it is needed. " + ASKED,
)
@click.option("--open", "is_open", is_flag=True, help="Let every computer of the network command, without a key.")
@click.option(
    "--control",
    type=click.IntRange(0, 65535),
    metavar="PORT",
    help="Port for simulated inputs (switches, probe): docs/senders.md.",
)
@click.option(
    "--speed",
    default="1",
    show_default=True,
    metavar="1|N|max",
    help="Speed relative to real time; max runs without a clock.",
)
@click.option("--board", default="host", show_default=True, help="Board id or TOML file: axes, timer, pulse timing.")
@on_chip_option("Run the board's real image, in the virtual chip; a PIC32MZ always does.")
@click.option(
    "--network",
    metavar="user|tap:NAME|off",
    help="What the Ethernet of an image is connected to: docs/espsim.md. Default: user, if libslirp is installed.",
)
@click.option("--machine", help="Machine profile, name or TOML file: steps/mm, rates, accelerations, travel.")
@click.option("--set", "lines", multiple=True, metavar="NAME=VALUE",
              help="A setting on top of that, such as max_rate_mm_min.x=5000 or '$110=5000'; repeatable.")  # fmt: skip
@click.option(
    "--settings", "store", type=click.Path(path_type=Path), metavar="FILE", help="Store settings in this file."
)
def command(
    tcp: str,
    http: str | None,
    http_names: tuple[str, ...],
    pty: Path | None,
    spindle_bus: Path | None,
    pendant: str | None,
    wmc3: str | None,
    io_module: bool,
    key: str,
    is_open: bool,
    control: int | None,
    speed: str,
    board: str,
    on_chip: str | None,
    network: str | None,
    machine: str | None,
    lines: tuple[str, ...],
    store: Path | None,
) -> None:
    """Run a simulated Grbl controller in real time. Connect any sender by TCP or by a serial port.

    The first client that sends a line is the owner; all others see the answers. `$TAKE` takes control. With
    --on-chip (a PIC32MZ: always) the board's real image runs; all clients are at its serial port, or at its Ethernet.
    """
    the_board, profile = _board_and_machine(board, machine)
    options = ServeOptions(
        **_chip(the_board, on_chip, network),
        **_doors(tcp, http, http_names, io_module, pendant),
        pty=pty,
        spindle_bus=spindle_bus,
        wmc3=parse_wmc3(wmc3, parse_speed(speed)) if wmc3 else None,
        io_module=io_module,
        key=key,
        control=control,
        speed=parse_speed(speed),
        **_stored(profile, store, lines),
    )
    _run(_with_key(options, is_open), speed)


def _chip(board: Board, on_chip: str | None, network: str | None) -> dict[str, Any]:
    """What runs, as ServeOptions has it: the host's controller, or the board's image. Raises UserError."""
    virtual = on_chip is not None or board.target == "pic32mz"
    if network and not virtual:
        raise UserError("--network is of an image that runs in the virtual chip", hint="add --on-chip")
    if virtual:
        require_chips(f"the image of {board.id}" if on_chip is None else "--on-chip")
    return {"board": board, "on_chip": virtual, "image": chip_image(on_chip or ""), "network": network}


def _stored(profile: Machine | None, store: Path | None, lines: tuple[str, ...]) -> dict[str, Any]:
    """Settings, their file and the machine around, as ServeOptions has them. Raises UserError."""
    return {
        "settings": (*_of_profile(profile, store), *map(parse_setting, lines)),
        "hands": tuple(end_switches(profile)) if profile else (),
        "store": store,
    }


def _doors(
    tcp: str, http: str | None, http_names: tuple[str, ...], io_module: bool, pendant: str | None
) -> dict[str, Any]:
    """Of text, page and pendant, as ServeOptions has them. Raises UserError."""
    return {
        "tcp": None if io_module else parse_address(tcp) or (NOWHERE if http else None),
        "http": parse_address(http, "--http", DEFAULT_HTTP_PORT) if http else None,
        "http_names": tuple(map(parse_host_name, http_names)),
        "pendant": parse_pendant(pendant) if pendant else None,
    }


def _board_and_machine(board: str, machine: str | None) -> tuple[Board, Machine | None]:
    """Which fit. Raises UserError."""
    the_board, profile = load_board(board), load_machine(machine) if machine else None
    check_axes(the_board, profile)
    return the_board, profile


def _is_reachable(options: ServeOptions) -> bool:
    """From other computers."""
    wire = options.wmc3 is not None and not ipaddress.ip_address(options.wmc3).is_loopback
    return wire or any(door and not door.is_loopback for door in (options.tcp, options.http))


def _with_key(options: ServeOptions, is_open: bool) -> ServeOptions:
    """Who can be reached by strangers has a key, unless someone wants it otherwise. Raises UserError."""
    if is_open and options.key:
        raise UserError("--open and --key exclude each other", hint="leave one of them out")
    if options.key and not 1 <= len(normal_key(options.key)) <= KEY_MAX:
        raise UserError(f"--key needs 1 to {KEY_MAX} letters and digits: dashes and spaces do not count")
    if options.on_chip and (is_open or options.key):
        raise UserError("--key and --open are of controllers that run on this computer: an image has its own key")
    if options.on_chip or is_open or options.key or not _is_reachable(options):
        return options
    key = make_key()
    ui.note(f"access key: {key}; --key chooses one, --open needs none")
    return replace(options, key=key)


def _of_profile(profile: Machine | None, store: Path | None) -> list[str]:
    """The profile's settings are those of a new file: what a file keeps already was meant by someone."""
    if profile is None:
        return []
    if store is not None and store.is_file() and store.stat().st_size > 0:
        ui.talk.print(f"The settings are those of {store}; --machine {profile.name} sets those of a new file.")
        return []
    return profile.settings_lines()


def _check_doors(options: ServeOptions) -> None:
    if options.http_names and not options.http:
        raise UserError("--http-name is of the page", hint="add --http 127.0.0.1:8080")
    if options.io_module and (not options.wmc3 or options.http or options.pty):
        raise UserError(
            "--io-module is controlled by the binary protocol only", hint="add --wmc3 127.0.0.1; no --http, no --pty"
        )
    if options.spindle_bus and options.board.spindle_bus is None:
        raise UserError(f"{options.board.id} has no [spindle_bus] in its board file", hint="--board host has one")
    if options.spindle_bus and options.on_chip:
        raise UserError("--spindle-bus is for controllers that run on this computer", hint="--board host")
    if options.spindle_bus and options.speed != 1.0:
        raise UserError("--spindle-bus needs real time", hint="--speed 1")
    if options.pendant and options.on_chip:
        raise UserError("--pendant is for controllers that run on this computer", hint="--board host")
    if options.pendant and options.board.pendant is None:
        raise UserError(f"{options.board.id} has no [pendant] in its board file", hint="--board host has one")
    if options.tcp is None and options.pty is None and options.wmc3 is None:
        raise UserError("no port is configured", hint="--pty LINK, or leave --tcp on")


def _run(options: ServeOptions, speed: str) -> None:
    """Serve until it is stopped."""
    _check_doors(options)
    for name in ("SIGTERM", "SIGBREAK"):  # the second one is Windows' Ctrl-Break
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _end)
    with suppress(KeyboardInterrupt), _server(options) as server, _page(server) as page_server:
        _print_doors(server, speed, page_server.url if page_server else "")
        if page_server and page_server.found_by_name is False:
            ui.warn("the page is not announced in the network: another program uses UDP port 5353; its address works")
        for event in server.events():
            _print_event(event)
        raise ServeError(f"the controller ended unexpectedly with exit code {server.stop()}")


def _server(options: ServeOptions) -> Server | ChipServer:
    """A board with a chip that can be had virtually runs its own image, every other one the host's controller."""
    if not options.on_chip:
        return Server(options)
    from wificnc_chips import ChipServer

    return ChipServer(options)


def _page(server: Server | ChipServer) -> AbstractContextManager[PageServer | None]:
    """What serves the page, if it is served."""
    options = server.options
    if options.http is None or (not isinstance(server, Server) and server.page):
        return nullcontext()
    board = options.board
    about = About("WiFiCNC on this computer", __version__, board.id, len(board.axes))
    return PageServer(options.http, server.tcp, about, page_folder(), names=options.http_names)


def _end(_number: int, _frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _print_doors(server: Server | ChipServer, speed: str, page: str) -> None:
    options = server.options
    pace = {"1": "in real time", "max": "as fast as it can"}.get(speed, f"at {speed} times real time")
    is_module = bool(server.wmc3) and not server.tcp and not server.device
    what = "An I/O module" if is_module else f"A controller of {len(options.board.axes)} axes"
    ui.talk.print(f"{what}, {pace}. Ctrl-C ends it.")
    if is_module and (options.tcp or options.pty):
        ui.warn("the settings file says that this is an I/O module (device_mode): it does not accept G-code")
    page = page if isinstance(server, Server) else server.page or page
    if page:
        ui.data.print(f"page    [bold]{escape(page)}[/]")
    if server.tcp:
        ui.data.print(f"tcp     [bold]{escape(server.tcp)}[/]")
    if server.wmc3:
        ui.data.print(f"wmc3    [bold]{escape(server.wmc3)}[/]")
    if server.control:
        ui.data.print(f"control [bold]{escape(server.control)}[/]")
    if isinstance(server, Server) and server.pendant:
        ui.data.print(f"pendant [bold]{escape(server.pendant)}[/]")
    if server.device:
        ui.data.print(f"serial  [bold]{escape(str(options.pty))}[/] -> {server.device}")
    if not isinstance(server, Server) and server.key:
        ui.data.print(f"key     [bold]{escape(server.key)}[/], of the image's network clients")
        if _is_reachable(options):
            ui.warn("others can foresee this key: the virtual chip's random numbers are the same in each run")
    elif _is_reachable(options) and not options.key:
        ui.warn("every computer on this network can control this controller")


def _print_event(event: ClientEvent) -> None:
    said = "commands now" if event.what == "owner" else event.what
    ui.note(f"{event.who} {said}")
