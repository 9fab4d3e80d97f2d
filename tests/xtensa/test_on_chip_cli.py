"""`--on-chip` and `--verify-boot` of a board with an ESP32, with an image that has our core and step engine in it, and
speaks at UART 0: emulators/tests/espsim/talk. Here, as it links the objects that this folder's tests compile."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import images
import numpy as np
import pytest
import talking
from on_chip import wificnc
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.errors import Exit
from wificnc.simulator.run import SimOptions, simulate
from wificnc_chips import greet, has_slirp
from wificnc_chips.esp32 import EspMachine, load_image
from xtensa import windows
from xtensa.toolchain import Toolchain

pytestmark = pytest.mark.slow  # compiles a program for the virtual chip

ROOT = Path(__file__).resolve().parents[2]
BOARD = "esp32-wroom32"
SHIFTED = "mks-tinybee"
ETHERNET = """
[ethernet]
chip = "w5500"
spi_host = "SPI3"
mosi = "GPIO23"
miso = "GPIO19"
sclk = "GPIO18"
cs = { pin = "GPIO5", allow = { strapping = "pulled up by the chip" } }
"""
NVS_SIZE = 0x6000  # partitions.csv


@pytest.fixture(scope="module")
def build(tools: Toolchain, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `wificnc build` leaves it."""
    if said := windows.missing(tools):
        pytest.skip(said)
    elf = talking.build(tools).read_bytes()
    return talking.make_folder(tmp_path_factory.mktemp("build") / BOARD, elf, talking.application(elf))


@pytest.fixture(scope="module")
def shifted(tools: Toolchain, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same of a board whose steps leave by shift registers."""
    if said := windows.missing(tools):
        pytest.skip(said)
    elf = talking.build(tools, load_board(SHIFTED)).read_bytes()
    return talking.make_folder(tmp_path_factory.mktemp("build") / SHIFTED, elf, talking.application(elf), SHIFTED)


@pytest.fixture
def ethernet(tmp_path: Path) -> Path:
    """That board with a W5500: of no product. Its image does not know of it."""
    text = (ROOT / "boards" / f"{SHIFTED}.toml").read_text()
    path = tmp_path / "ethernet.toml"
    path.write_text(text + ETHERNET)
    return path


def sim(job: Path, *options: object) -> int:
    return wificnc("sim", job, "--board", BOARD, *options)


@pytest.mark.usefixtures("cycle_each")
def test_a_job_makes_the_hosts_steps(build: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", build, "--set", "$110=3000", "--set", "$120=500") == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    0, 0, 250, 250, 0, 0 steps" in said and "0 refused" in said


@pytest.mark.parametrize("kind", ["merged", "application"])
def test_files_of_a_release(
    build: Path, job: Path, kind: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Alone, without the ELF file: this image has no radio to be answered."""
    application = (build / "firmware.bin").read_bytes()
    image = tmp_path / f"{kind}.bin"
    image.write_bytes(images.merged(0, application) if kind == "merged" else application)
    job.write_text("G21G91\nG1X1F1500\n")
    assert sim(job, "--on-chip", image) == Exit.OK
    assert "the same steps" in capsys.readouterr().out


@pytest.mark.usefixtures("cycle_each")
def test_step_events_as_the_host_writes_them(build: Path, job: Path, tmp_path: Path) -> None:
    """The same columns; times from the first step, to a tick of 50 ns."""
    job.write_text("G21G91\nG1X2Y1F1500\n")
    assert sim(job, "--on-chip", build, "--trace", tmp_path / "chip.npz") == Exit.OK
    simulate(SimOptions(job, BOARD, trace=tmp_path / "host.npz"))
    with np.load(tmp_path / "chip.npz") as chip_file, np.load(tmp_path / "host.npz") as host_file:
        chip, host = dict(chip_file), dict(host_file)
    assert chip["t_ns"].dtype == host["t_ns"].dtype and len(chip["t_ns"]) == len(host["t_ns"]) >= 500
    np.testing.assert_array_equal(chip["step_mask"], host["step_mask"])
    np.testing.assert_array_equal(chip["dir_mask"] & chip["step_mask"], host["dir_mask"] & host["step_mask"])
    np.testing.assert_allclose(
        chip["t_ns"].astype(np.int64), host["t_ns"].astype(np.int64) - int(host["t_ns"][0]), atol=50
    )


def test_pins_as_csv_and_vcd(build: Path, job: Path, tmp_path: Path) -> None:
    """Each pulse has two edges, never nearer than $0, 3 us; the wave viewer's file has as many."""
    job.write_text("G21G91\nG1X-1F1500\n")
    for suffix in ("csv", "vcd"):
        assert sim(job, "--on-chip", build, "--trace", tmp_path / f"pins.{suffix}") == Exit.OK
    rows = [line.split(",") for line in (tmp_path / "pins.csv").read_text().splitlines()[1:]]
    steps = [(int(t), int(level)) for t, label, level in rows if label == "step_x_GPIO25"]
    assert [level for _, level in steps] == [1, 0] * 250
    assert min(fall - rise for (rise, _), (fall, _) in zip(steps[::2], steps[1::2], strict=True)) >= 3000
    vcd = (tmp_path / "pins.vcd").read_text()
    assert "$timescale 1 ns $end" in vcd and "step_x_GPIO25 $end" in vcd
    assert vcd.partition("$dumpvars")[2].partition("$end")[2].count(f"1{chr(33 + 25)}\n") == 250


@pytest.mark.deep  # an image of its own; test_espsim_engines.py has its steps
def test_a_job_leaves_by_shift_registers(shifted: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both ways of both axes: registers come up with all outputs high, and a direction that stays so has no edge."""
    job.write_text("G21G91\nG1X-2Y1F900\nX2Y-1\nX1\n")
    options = ("--board", SHIFTED, "--on-chip", shifted)
    assert wificnc("sim", job, *options) == Exit.OK
    said = capsys.readouterr().out
    assert "the same steps" in said and "position    250, 0, 0, 0, 0 steps" in said
    assert wificnc("sim", job, *options, "--trace", job.with_suffix(".vcd")) == Exit.OK
    assert "step_x_I2SO.1 $end" in job.with_suffix(".vcd").read_text()
    assert wificnc("sim", job, *options, "--at", "1s I2SO.1 low") == Exit.USAGE
    assert "i2so.1 is an output of a shift register, and cannot be driven" in capsys.readouterr().err


def test_a_refused_line_is_named(build: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    job.write_text("G21\nG1X1\n")
    assert sim(job, "--on-chip", build) == Exit.JOB
    assert "line 2: error:22" in capsys.readouterr().err


def test_pins_that_are_none(build: Path, job: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sim(job, "--on-chip", build, "--at", "1s GPIO77 low") == Exit.USAGE
    assert "'2.5s GPIO25 high'" in capsys.readouterr().err


def test_pins_are_driven_at_their_time(build: Path) -> None:
    """The switches of the board rest at first; GPIO36 has no pull-up of its own."""
    board = load_board(BOARD)
    chip = EspMachine(board, load_image(build, board))
    try:
        assert chip.level(36) == 1
        chip.drive_at(chip.cycles + 240_000, 36, 0)
        chip.run(0.0005)
        assert chip.level(36) == 1
        chip.run(0.001)
        assert chip.level(36) == 0
    finally:
        chip.close()


class Slow:
    """A chip that says this, a piece in each look."""

    cpu_hz = 1000

    def __init__(self, *pieces: bytes) -> None:
        self.pieces, self.cycles = [*pieces], 0

    def run(self, seconds: float) -> None:
        self.cycles += round(seconds * self.cpu_hz)

    def read(self) -> bytes:
        return self.pieces.pop(0) if self.pieces else b""


def test_a_startup_lines_answer_belongs_to_the_start() -> None:
    """It would count as one of the job's."""
    chip: Any = Slow(b"", b"\r\nGrbl 1.1h ['$' for help]\r\n>G54:", b"ok\r\n", b"", b"more")
    assert greet(chip).endswith(">G54:ok\r\n") and chip.pieces == [b"more"]


def test_a_restart_is_as_the_first_start(build: Path) -> None:
    board = load_board(BOARD)
    chip = EspMachine(board, load_image(build, board))
    try:
        said = greet(chip)
        assert "Grbl 1.1h" in said
        chip.write(b"$100=300\n")
        chip.run(0.05)
        chip.power_on()
        assert greet(chip).endswith(said.splitlines()[-1] + "\r\n")
    finally:
        chip.close()


def test_the_settings_partition_is_kept(build: Path, tmp_path: Path) -> None:
    """What was put there is there after a start, and nothing else of the flash has changed."""
    board = load_board(BOARD)
    chip = EspMachine(board, load_image(build, board))
    try:
        kept = bytes(range(256)) * (NVS_SIZE // 256)
        assert chip.settings() == b"\xff" * NVS_SIZE
        chip.set_settings(kept, tmp_path / "settings.bin")
        chip.power_on()
        assert "Grbl 1.1h" in greet(chip) and chip.settings() == kept
    finally:
        chip.close()


# ---- serve ----


@contextmanager
def serving(*options: object, board: object = BOARD) -> Iterator[dict[str, str]]:
    """A server, and where it listens."""
    command = [sys.executable, "-m", "wificnc", "serve", "--board", board, "--tcp", "127.0.0.1:0", "--control", "0"]
    process = subprocess.Popen(
        [str(word) for word in (*command, *options)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=ROOT,
    )
    doors: dict[str, str] = {}
    try:
        assert process.stdout
        while "control" not in doors:
            name, where = process.stdout.readline().split()
            doors[name] = where
        yield doors
    finally:
        process.terminate()
        process.wait(HANG_S)
        if process.stdout:
            process.stdout.close()


def connect(where: str) -> socket.socket:
    host, port = where.split(":")
    return socket.create_connection((host, int(port)), HANG_S)


def until(client: socket.socket, wanted: bytes) -> bytes:
    said = b""
    while wanted not in said:
        data = client.recv(4096)
        assert data, said
        said += data
    return said


def test_a_job_by_tcp_and_a_file_of_settings(build: Path, job: Path, tmp_path: Path) -> None:
    """Streamed by our own sender, as fast as the computer can; the settings' partition is kept."""
    job.write_text("G21G90\nG1X10F3000\nX0\nM30\n")
    store = tmp_path / "settings.bin"
    with serving("--on-chip", build, "--speed", "max", "--settings", store) as doors:
        command = [sys.executable, "-m", "wificnc", "send", str(job), "--to", f"tcp://{doors['tcp']}"]
        run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False)
        assert run.returncode == 0, run.stdout + run.stderr
        with connect(doors["tcp"]) as client:
            client.sendall(b"?")
            said = until(client, b">")
        assert b"MPos:0.000,0.000,0.000" in said
    assert store.stat().st_size == NVS_SIZE


def test_settings_of_another_board(build: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = tmp_path / "settings.bin"
    store.write_bytes(bytes(100))
    options = ("--board", BOARD, "--on-chip", build, "--tcp", "127.0.0.1:0", "--settings", store)
    assert wificnc("serve", *options) == Exit.USAGE
    assert f"has 100 bytes, not the {NVS_SIZE} of the settings' partition" in capsys.readouterr().err
    assert store.read_bytes() == bytes(100)


def ask(client: socket.socket, line: str) -> str:
    """A line of the control port."""
    client.sendall(line.encode() + b"\n")
    return until(client, b"\n").decode().strip()


def test_the_control_port_has_hands_at_the_pins(build: Path) -> None:
    """Levels are those of the chip's pins, the position is that of the pulses, and a switched off chip starts again."""
    with serving("--on-chip", build, "--speed", "max") as doors, connect(doors["control"]) as control:
        pins = dict(zip((words := ask(control, "pins").split())[::2], words[1::2], strict=True))
        assert pins["limit_x"] == "1" and pins["step_x"] == "0"
        assert ask(control, "limit_x low") == ask(control, "GPIO39 low") == "ok"
        pins = dict(zip((words := ask(control, "pins").split())[::2], words[1::2], strict=True))
        assert (pins["limit_x"], pins["limit_y"], pins["limit_z"]) == ("0", "0", "1")
        with connect(doors["tcp"]) as client:
            client.sendall(b"G21G91\nG1X1Y-2F3000\nG4P0\n")
            said = until(client, b"ok\r\nok\r\nok\r\n")
            assert ask(control, "position") == "250 -500 0 0 0 0"
            assert ask(control, "power") == "ok"
            said = until(client, b"['$' for help]")
            assert b"Grbl 1.1h" in said
        assert ask(control, "link down") == "error: this chip has no cable (--network)"
        assert ask(control, "GPIO77 low").startswith("error: 'GPIO77 low' is not one of: PIN or SIGNAL high")
        assert ask(control, "") == "ok"


def test_a_board_with_ethernet_is_reached_there(build: Path, ethernet: Path) -> None:
    """By the board file, with the image of BOARD, which is built already. A call of this computer is one of the image's
    network, which this image does not answer; its wire is the pseudo-terminal's alone. Of shift registers no output can
    be driven."""
    if not has_slirp():
        pytest.skip("no libslirp: apt-get install libslirp0")
    application = build / "firmware.bin"
    with serving("--on-chip", application, "--network", "user", "--wmc3", "127.0.0.82", board=ethernet) as doors:
        assert doors["wmc3"] == "127.0.0.82"
        with connect(doors["tcp"]) as client, connect(doors["control"]) as control:
            assert ask(control, "link down") == ask(control, "link up") == "ok"
            assert ask(control, "I2SO.1 low").endswith("is an output of a shift register, and cannot be driven")
            client.sendall(b"?")
            client.setblocking(False)
            with pytest.raises(BlockingIOError):
                client.recv(100)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--network", "user"), "--network user: board esp32-wroom32 has no [ethernet] in its board file"),
        (("--wmc3", "127.0.0.1"), "--wmc3 needs the image's Ethernet, which is not there"),
        (("--key", "abc"), "--key and --open are of controllers that run on this computer"),
    ],
)
def test_what_an_image_without_ethernet_cannot_serve(
    build: Path, options: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert wificnc("serve", "--board", BOARD, "--on-chip", build, *options) in (Exit.USAGE, Exit.DEVICE)
    assert says in capsys.readouterr().err


@pytest.mark.parametrize(
    ("network", "says"),
    [("lan", "--network 'lan' is not a network"), ("tap:none/there", "is not the name of a TAP device")],
)
def test_networks_that_there_are_not(
    build: Path, ethernet: Path, network: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--board", ethernet, "--on-chip", build / "firmware.bin", "--network", network, "--tcp", "off")
    assert wificnc("serve", *options, "--pty", build / "tty") == Exit.DEVICE
    assert says in capsys.readouterr().err


def test_a_network_is_of_a_chip(capsys: pytest.CaptureFixture[str]) -> None:
    assert wificnc("serve", "--network", "user") == Exit.USAGE
    assert "--network is of an image that runs in the virtual chip" in capsys.readouterr().err


# ---- flash ----


def test_an_image_that_boots_is_flashed(build: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert wificnc("flash", BOARD, "--from", build, "--verify-boot", "--dry-run") == Exit.OK
    said = capsys.readouterr()
    assert "Grbl 1.1h" in said.err and "[VER:1.1h" in said.err and "500 exact step events of a G1" in said.err
    assert "0x020000" in said.out


def failing(build: Path, folder: Path, old: bytes, new: bytes) -> Path:
    """The same build with other bytes in its program."""
    elf = (build / "firmware.elf").read_bytes()
    assert elf.count(old) >= 1 and len(old) == len(new)
    changed = elf.replace(old, new)
    return talking.make_folder(folder, changed, talking.application(changed))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"Grbl 1.1h [", b"Grbl-1.1h [", "the image has not said Grbl's banner"),
        (b"[VER:", b"[VAR:", "a version in the answer to $I is missing"),
    ],
    ids=["banner", "version"],
)
def test_an_image_that_fails_is_not_flashed(
    build: Path, tmp_path: Path, old: bytes, new: bytes, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not even the port is opened, which does not exist."""
    folder = failing(build, tmp_path / "bad", old, new)
    assert wificnc("flash", BOARD, "--from", folder, "--verify-boot", "--port", tmp_path / "none") == Exit.FLASH
    said = capsys.readouterr().err
    assert f"this firmware fails in the virtual chip: {says}" in said and "none" not in said.partition("fails")[2]
