"""The sender against `wificnc serve`: TCP, a serial port, and someone else who commands."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from patience import HANG_S
from sender import Nobody, Notes, run_job
from signals import usual_signals
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.client import Target, connected
from wificnc.errors import RefusedError
from wificnc.job.run import End, RunOptions
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

SETTINGS = tuple(f"${base + axis}={value}" for base, value in ((110, 20000), (120, 2000)) for axis in range(3))
JOB = "G21 G90\nF6000\n" + "".join(f"G1 X{i % 40} Y{i % 30}\n" for i in range(3000)) + "G0 X1 Y2 Z-3\n"


def start(tmp_path: Path, speed: float) -> Server:
    options = ServeOptions(
        board=load_board("host"),
        tcp=Address("127.0.0.1", 0),
        pty=tmp_path / "tty",
        speed=speed,
        settings=SETTINGS,
    )
    return Server(options)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with start(tmp_path, 0.0) as one:
        yield one


def targets(server: Server, tmp_path: Path) -> list[str]:
    return [f"tcp://{server.tcp}", f"serial://{tmp_path / 'tty'}"]


def test_same_job_over_tcp_and_over_a_serial_port(server: Server, tmp_path: Path) -> None:
    for target in targets(server, tmp_path):
        with connected(target) as client:
            client.synchronise()
            outcome = run_job(client, JOB, RunOptions(client.options()))
            assert outcome.complete, outcome
            assert outcome.answered == 3003
            assert outcome.snapshot.mpos[:3] == (1.0, 2.0, -3.0)


def test_somebody_else_commands(server: Server, tmp_path: Path) -> None:
    tcp, serial = targets(server, tmp_path)
    with connected(tcp) as owner:
        owner.synchronise()
        with connected(serial) as other:
            assert other.look().state == "Idle"
            with pytest.raises(RefusedError, match="another client is in control") as error:
                other.synchronise()
            assert error.value.hint == "--take takes control"
        with connected(Target(serial, take=True)) as other:
            other.synchronise()
            other.must("G0X5")


def test_taken_over_in_the_middle_of_a_job(tmp_path: Path) -> None:
    with start(tmp_path, 1.0) as server:
        tcp, serial = targets(server, tmp_path)
        with connected(tcp) as owner, connected(Target(serial, take=True)) as other:
            owner.synchronise()
            taken: list[bool] = []

            def take(progress: object) -> None:
                if not taken and owner.now().status.state == "Run":
                    taken.append(True)
                    other.send(b"$TAKE\n")

            outcome = run_job(owner, JOB, RunOptions(owner.options()), Nobody(), Notes(take))
            assert outcome.end is End.TAKEN
            assert "another client has taken control" in outcome.detail
            assert 0 < outcome.answered < outcome.lines


def test_stopped_sender_leaves_the_machine_standing_where_it_says(tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text(JOB)
    with start(tmp_path, 1.0) as server:
        target = f"tcp://{server.tcp}"
        with usual_signals():
            process = subprocess.Popen(
                [sys.executable, "-m", "wificnc", "send", str(job), "--to", target, "--json"],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            )  # fmt: skip
        with connected(target) as watcher:
            while watcher.look().status.state != "Run" or not watcher.look().mpos[0]:
                watcher.wait(0.1)
            process.send_signal(signal.SIGINT)
            document = json.loads(process.communicate(timeout=HANG_S)[0])
        assert process.returncode == 1
        assert document["end"] == "stopped"
        assert 3 <= document["running_line"] <= document["last_answered_line"]
        status = CliRunner().invoke(root, ["status", "--to", target, "--json"])
        assert json.loads(status.stdout)["state"] == "Idle"  # held before the reset: the position is kept
        assert json.loads(status.stdout)["machine_position"] == document["machine_position"]
