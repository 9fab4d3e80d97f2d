"""`--json`: every command has it or a reason why not, and stdout is one document and nothing else."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rich_click as click
from chip import make_build
from core_bridge import FAST, Bridge
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.discover import Found
from wificnc.errors import Exit
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

Cli = Callable[..., tuple[int, str, str]]

HOMING = "$22=1\n$24=600\n$25=3000\n$26=5\n$130=50\n$131=50\n$132=50\n"
ADDRESS = f"127.60.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed

FLUIDNC = Path(__file__).parents[1] / "fluidnc" / "router.yaml"
NOTHING_TO_REPORT = "the exit code says all"
WITHOUT = {
    "monitor": "interactive, or a pipe both ways",
    "demo": "its output is a picture; `wificnc sim --json` has the figures",
    "serve": "runs until it is stopped; each line of stdout is the address of one port",
    "expand": "its output is G-code",
    "tune pattern": "its output is G-code",
    "dev pins": "its output is a C header",
    "dev page": "its output is a C header",
    "dev signing-key": "its output is a C header",
    "wifi set": NOTHING_TO_REPORT,
    "linuxcnc pair": NOTHING_TO_REPORT,
    **dict.fromkeys((f"wmc3 {name}" for name in ("estop", "hold", "home", "jog", "output", "reset", "resume", "take")),
                    NOTHING_TO_REPORT),
}  # fmt: skip

# words after the command; {grbl} is a controller that homes, {hub} one with a key, {drivers} with drivers, {wmc3} a
# device, {module} an I/O module, {job} a G-code file, {log} one of an accelerometer, {nvs} an image, {toml} settings of
# the controller, {out} a name that is free, {fluidnc} a configuration of FluidNC
CASES = {
    "discover": "--json",
    "status": "--to {grbl} --json",
    "login": "{hub} --list --key correct-horse --json",
    "home": "--to {grbl} --json",
    "unlock": "--to {grbl} --json",
    "jog": "X1 --to {grbl} --json",
    "probe": "Z-10 --feed 300 --to {grbl} --json",
    "settings get": "--to {grbl} --json",
    "settings set": "max_rate_mm_min.x=4000 --to {grbl} --json",
    "settings export": "--to {grbl} --json",
    "settings import": "{toml} --to {grbl} --yes --json",
    "settings diff": "{toml} {toml} --json",
    "drivers": "--to {drivers} --json",
    "tune measure": "--feed 2400 --waves 8 --distance 7.75 --json",
    "tune log": "{log} --json",
    "tune predict": "{job} --hz 40 --json",
    "check": "{job} --machine shapeoko3 --json",
    "sim": "{job} --json -",
    "send": "{job} --to {grbl} --json",
    "boards list": "--json",
    "boards show": "esp32s3-zero --json",
    "boards check": "esp32s3-zero --json",
    "boards import": "{fluidnc} -o {out}-b.toml --machine {out}-m.toml --json",
    "flash": "esp32s3-zero --from {firmware} --dry-run --json",
    "wifi status": "--json",
    "nvs build": "shapeoko3 -o {out} --json",
    "nvs read": "{nvs} --json",
    "nvs flash": "{nvs} --dry-run --json",
    "nvs diff": "{nvs} {nvs} --json",
    "build": "host --json",
    "release": "--dry-run --json",
    "doctor": "--json",
    "wmc3 handshake": "--to {wmc3} --json",
    "wmc3 discover": "--json",
    "wmc3 status": "--to {wmc3} --json",
    "wmc3 channel": "0 --input --pin 16 --to {module} --json",
    "wmc3 counters": "--to {wmc3} --json",
    "wmc3 config": "--to {wmc3} --json",
    "wmc3 motion": "X=10 --to {wmc3} --json",
    "wmc3 bench": "--requests 10 --seconds 0.5 --to {wmc3} --json",
    "linuxcnc component": "--out {out} --json",
    "linuxcnc init": "shapeoko3 --to 192.0.2.1 --out {out} --json",
}
MAY_FAIL = {"doctor": Exit.JOB}  # when this computer lacks a right


def commands() -> dict[str, click.Command]:
    """All that can be run, by their words."""

    def walk(command: click.Command, words: str) -> Iterator[tuple[str, click.Command]]:
        if not isinstance(command, click.Group):
            yield words, command
            return
        context = click.Context(command)
        for name in command.list_commands(context):
            child = command.get_command(context, name)
            assert child is not None
            yield from walk(child, f"{words} {name}".strip())

    return dict(walk(root, ""))


def test_every_command_has_it_or_a_reason() -> None:
    having = {words for words, command in commands().items() if any("--json" in one.opts for one in command.params)}
    assert having.isdisjoint(WITHOUT) and having | set(WITHOUT) == set(commands())
    assert set(CASES) == having
    assert all(reason.strip() for reason in WITHOUT.values())


def test_it_is_the_same_option_everywhere() -> None:
    """sim alone writes it to a file, too."""
    options = {words: next((one for one in command.params if "--json" in one.opts), None)
               for words, command in commands().items()}  # fmt: skip
    helps = {one.help for words, one in options.items() if isinstance(one, click.Option) and words != "sim"}
    assert len(helps) == 1


@contextmanager
def grbl() -> Iterator[str]:
    with Bridge(settings=FAST + HOMING) as bridge:
        for axis in range(3):
            bridge.travel(axis, -1000, 2000)
        bridge.surface(-500)
        yield bridge.target


@contextmanager
def device(io_module: bool) -> Iterator[str]:
    options = ServeOptions(board=load_board("host"), wmc3=ADDRESS, io_module=io_module)
    with Server(options, "release"):
        yield ADDRESS


def free_vibration() -> str:
    """Of 50 Hz, as an accelerometer sees it."""
    rows = (f"{n / 1000},{math.exp(-n / 200) * math.sin(n * math.pi / 10)}" for n in range(2000))
    return "\n".join(("time,x", *rows))


@pytest.fixture
def places(tmp_path: Path, cli: Cli) -> Iterator[Callable[[str], dict[str, Any]]]:
    """What the words of a case need, and no more."""
    with ExitStack() as stack:

        def provide(words: str) -> dict[str, Any]:
            made: dict[str, Any] = {"out": tmp_path / "out", "job": tmp_path / "job.nc", "fluidnc": FLUIDNC}
            (tmp_path / "job.nc").write_text("G21\nG0X1\nM2\n")
            if "{grbl}" in words:
                made["grbl"] = stack.enter_context(grbl())
            if "{hub}" in words:
                hub = ServeOptions(board=load_board("host"), tcp=Address("127.0.0.1", 0), key="correct-horse")
                made["hub"] = stack.enter_context(Server(hub, "release")).tcp
            if "{drivers}" in words:
                drivers = ServeOptions(board=load_board("fysetc-e4"), tcp=Address("127.0.0.1", 0))
                made["drivers"] = stack.enter_context(Server(drivers, "release")).tcp
            for name in ("wmc3", "module"):
                if f"{{{name}}}" in words:
                    made[name] = stack.enter_context(device(name == "module"))
            if "{toml}" in words:
                made["toml"] = tmp_path / "settings.toml"
                made["toml"].write_text("schema = 1\n\n[axis.x]\nmax_rate_mm_min = 4000.0\n")
            if "{nvs}" in words:
                made["nvs"] = tmp_path / "nvs.bin"
                cli("nvs", "build", "shapeoko3", "-o", made["nvs"])
            if "{log}" in words:
                made["log"] = tmp_path / "accel.csv"
                made["log"].write_text(free_vibration())
            if "{firmware}" in words:
                made["firmware"] = make_build(tmp_path / "firmware", "esp32s3-zero", "esp32s3")
            return made

        yield provide


def stand_ins(monkeypatch: pytest.MonkeyPatch) -> None:
    """A network with one controller, and a board at a port."""
    found = Found("wificnc-1a2b", "192.0.2.1", 23)
    monkeypatch.setattr("wificnc.commands.discover.discover", lambda seconds: [found])
    report = SimpleNamespace(state=0)
    monkeypatch.setattr("wificnc.commands.wmc3.find_devices", lambda *_: iter([("192.0.2.1", report)]))

    @contextmanager
    def board(port: str | None) -> Iterator[Any]:
        yield SimpleNamespace(
            identify=lambda: SimpleNamespace(mac="00:00:00:00:00:01"),
            read=lambda offset, size: b"\xff" * size,
            reset=lambda: None,
        )

    monkeypatch.setattr("wificnc.commands.wifi.connected", board)


@pytest.mark.parametrize("command", CASES)
def test_stdout_is_one_document(
    command: str, cli: Cli, places: Callable[[str], dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_ins(monkeypatch)
    words = CASES[command].format(**places(CASES[command]))
    code, out, err = cli(*command.split(), *words.split())
    assert code in (Exit.OK, MAY_FAIL.get(command, Exit.OK)), err
    assert isinstance(json.loads(out), (dict, list))


def test_a_refusal_leaves_stdout_empty(cli: Cli) -> None:
    """What is not one document must not be half of one."""
    code, out, err = cli("status", "--to", "127.0.0.1:1", "--json")
    assert (code, out) == (Exit.DEVICE, "") and "error:" in err
