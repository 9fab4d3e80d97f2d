"""The component's program: its command line, and a controller that comes late, goes, and comes back."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from halrun_file import Rig, hal_file, serve, stands
from patience import HANG_S
from wificnc import __version__
from wificnc.build.checkout import checkout_root

ADDRESS = f"127.66.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
# With no one there LinuxCNC continues; Python learns how far we are by files.
STORY = """getp wificnc.connected
getp wificnc.estop-ok
getp wificnc.ready
loadusr -w touch {home}/begun
loadusr -w {wait} wificnc connected TRUE estop-ok TRUE ready TRUE fault FALSE
setp wificnc.enable 1
loadusr -w {wait} wificnc queue-ms 1-
setp limit3.0.in 1.5
loadusr -w {wait} wificnc joint.0.position-fb 1.5
loadusr -w touch {home}/moved
loadusr -w {wait} wificnc connected FALSE estop-ok FALSE ready FALSE fault TRUE
setp wificnc.enable 0
loadusr -w touch {home}/lost
loadusr -w {wait} wificnc connected TRUE estop-ok TRUE fault TRUE ready FALSE
setp wificnc.reset 1
loadusr -w {wait} wificnc ready TRUE fault FALSE
setp limit3.0.in 0
loadusr -w {wait} wificnc connected TRUE
setp wificnc.enable 1
loadusr -w {wait} wificnc queue-ms 1-
setp limit3.0.in -2
loadusr -w {wait} wificnc joint.0.position-fb -2
"""


def run(program: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([program, *words], capture_output=True, text=True, timeout=HANG_S, check=False)


def test_it_says_what_the_documentation_says(hal_program: Path) -> None:
    text = (checkout_root() / "docs" / "linuxcnc.md").read_text(encoding="utf-8")
    said = run(hal_program, "--help")
    assert said.returncode == 0 and said.stderr == ""
    assert set(re.findall(r"^\| `(--[\w-]+)` \|", text, re.MULTILINE)) == set(
        re.findall(r"^  (--\S+)", said.stdout, re.M)
    )
    assert run(hal_program, "--version").stdout.strip() == __version__


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ([], "--address is missing"),
        (["--address", "127.0.0.1", "--joints", "7"], "--joints 7: it is a whole number from 1 to 6"),
        (["--address", "127.0.0.1", "--joints", "0"], "--joints 0: it is a whole number from 1 to 6"),
        (["--address", "127.0.0.1", "--queue-ms", "9"], "--queue-ms 9: it is a number from 10 to 1000"),
        (["--address", "127.0.0.1", "--queue-ms", "1s"], "--queue-ms 1s: it is a number"),
        (["--address", "127.0.0.1", "--run-up-s", "nan"], "--run-up-s nan: it is a number"),
        (["--address", "127.0.0.1", "--sampler", "-1"], "--sampler -1: it is a whole number from 0"),
        (["--address", "127.0.0.1", "--joints", "2.5"], "--joints 2.5: it is a whole number from 1 to 6"),
        (["--address", "127.0.0.1", "more"], "more is behind the options"),
        (["--adress", "127.0.0.1"], "--adress"),
        (["--address", "controller"], "--address controller: it is an IPv4 address"),
    ],
)
def test_a_wrong_command_line_says_what_is_wrong(hal_program: Path, words: list[str], why: str) -> None:
    """Before it touches HAL, so that `loadusr -W` does not wait."""
    said = run(hal_program, *words)
    assert said.returncode == 1 and why in said.stderr


def test_without_its_sampler_it_says_which(user_home: Path, as_user: Callable[..., str]) -> None:
    script = user_home / "test.hal"
    script.write_text(f"loadusr -Wn wificnc wificnc-hal --address {ADDRESS} --joints 3\n")
    assert "loadrt sampler depth=1000 cfg=ffffs" in as_user("halrun", "-f", str(script), code=1)


@pytest.mark.slow
def test_a_controller_that_comes_late_goes_and_comes_back(user_home: Path, as_user: Callable[..., str]) -> None:
    rig = Rig("wificnc", ADDRESS, (200,), ())
    story = STORY.replace("{home}", str(user_home))

    def reached(name: str, running: Future[str]) -> None:
        end = time.monotonic() + HANG_S
        while not (user_home / name).exists():
            assert time.monotonic() < end and not running.done(), (name, running.done() and running.result())
            time.sleep(0.01)

    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(as_user, "halrun", "-f", hal_file(user_home, rig, then=story, is_there=False))
        reached("begun", running)
        with serve(ADDRESS):
            reached("moved", running)
        reached("lost", running)
        with serve(ADDRESS):
            said = running.result()
            assert stands(ADDRESS).position_steps[0] == -400, "it begins again where the controller is"
    assert said.split()[:3] == ["FALSE"] * 3, "LinuxCNC did not wait for ever"
