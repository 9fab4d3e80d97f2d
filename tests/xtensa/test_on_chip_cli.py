"""`--on-chip` and `--verify-boot` of a board with an ESP32, with an image that has our core and step engine in it, and
speaks at UART 0: tests/espsim/talk. Here, as it links the objects that this folder's tests compile."""

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
from patience import HANG_S
from wificnc.app import main
from wificnc.board.load import load_board
from wificnc.chip.esp_image import load_image
from wificnc.chip.esp_machine import EspMachine
from wificnc.chip.wired import greet
from wificnc.errors import Exit
from wificnc.sim.run import SimOptions, simulate
from xtensa import windows
from xtensa.toolchain import Toolchain

ROOT = Path(__file__).resolve().parents[2]
BOARD = "esp32-wroom32"
JOB = "G21G90\nG1X2F1500\nG2X4Y2I0J2\nM0\nG1X0Y0Z1A1\n"
NVS_SIZE = 0x6000  # partitions.csv


@pytest.fixture(scope="module")
def build(tools: Toolchain, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `wificnc build` leaves it."""
    if said := windows.missing(tools):
        pytest.skip(said)
    elf = talking.build(tools).read_bytes()
    return talking.make_folder(tmp_path_factory.mktemp("build") / BOARD, elf, talking.application(elf))


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.nc"
    path.write_text(JOB)
    return path


def wificnc(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


def sim(job: Path, *options: object) -> int:
    return wificnc("sim", job, "--board", BOARD, *options)


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
def serving(*options: object) -> Iterator[str]:
    """A server, and where it listens."""
    command = [sys.executable, "-m", "wificnc", "serve", "--board", BOARD, "--tcp", "127.0.0.1:0", *map(str, options)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT)
    try:
        assert process.stdout
        yield process.stdout.readline().split()[1]
    finally:
        process.terminate()
        process.wait(HANG_S)
        if process.stdout:
            process.stdout.close()


def test_a_job_by_tcp_and_a_file_of_settings(build: Path, job: Path, tmp_path: Path) -> None:
    """Streamed by our own sender, as fast as the computer can; the settings' partition is kept."""
    job.write_text("G21G90\nG1X10F3000\nX0\nM30\n")
    store = tmp_path / "settings.bin"
    with serving("--on-chip", build, "--speed", "max", "--settings", store) as address:
        command = [sys.executable, "-m", "wificnc", "send", str(job), "--to", f"tcp://{address}"]
        run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, cwd=ROOT, check=False)
        assert run.returncode == 0, run.stdout + run.stderr
        host, port = address.split(":")
        with socket.create_connection((host, int(port)), HANG_S) as client:
            client.sendall(b"?")
            said = b""
            while b">" not in said:
                said += client.recv(4096)
        assert b"MPos:0.000,0.000,0.000" in said
    assert store.stat().st_size == NVS_SIZE


def test_settings_of_another_board(build: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = tmp_path / "settings.bin"
    store.write_bytes(bytes(100))
    options = ("--board", BOARD, "--on-chip", build, "--tcp", "127.0.0.1:0", "--settings", store)
    assert wificnc("serve", *options) == Exit.USAGE
    assert f"has 100 bytes, not the {NVS_SIZE} of the settings' partition" in capsys.readouterr().err
    assert store.read_bytes() == bytes(100)


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
