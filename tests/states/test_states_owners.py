"""Motion goes from a text sender to a remote host and back, and one of them is lost meanwhile."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from generate.states_table import load_states
from remote_host import RemoteHosts
from state_machine import LINES, SETTLED_S, answers

INPUTS = load_states().inputs
HELD = "[MSG:Sender lost: feed hold]"
HOST_STEPS = -10  # of host_motion


@pytest.fixture
def hosts() -> Iterator[RemoteHosts]:
    """A controller with remote hosts; 10 steps/mm."""
    controller = RemoteHosts()
    controller.send("")
    controller.fine(*LINES)
    yield controller
    controller.close()


@pytest.mark.parametrize("line", ["G91G1X-5F600\n", "$J=G91X-5F600\n", "$H\n"])
def test_lines_of_a_lost_sender_do_not_run_when_the_host_is_done(hosts: RemoteHosts, line: str) -> None:
    assert hosts.packet(INPUTS["host_motion"]) == "done"
    hosts.after(0.05, line)
    hosts.lose_sender()
    said = hosts.after(SETTLED_S)
    assert HELD in said and hosts.state() == "Hold:0" and hosts.notice() == HELD[5:-1]
    assert hosts.position()[0] == HOST_STEPS


@pytest.mark.parametrize("when_s", [0.05, SETTLED_S])
def test_an_interrupted_job_waits_without_its_tools_for_the_next_client(hosts: RemoteHosts, when_s: float) -> None:
    """Lost while the host moves, or after it has given motion back."""
    hosts.fine("M3S500M8")
    hosts.after(0.5, "G91G1X-100F600\n")
    assert hosts.packet(INPUTS["host_motion"]) == "done"
    hosts.after(when_s)
    hosts.lose_sender()
    said = hosts.after(SETTLED_S)
    assert HELD in said and hosts.state() == "Hold:0" and hosts.notice() == HELD[5:-1]
    assert (hosts.outputs().spindle_direction, hosts.outputs().coolant) == (0, 0)
    left = hosts.position()
    hosts.after(3, "~")
    assert hosts.outputs().spindle_direction == 1 and hosts.position() == left, "it runs up first"
    hosts.after(60)
    assert hosts.position()[0] == -1000 and hosts.state() == "Idle" and hosts.notice() is None
    assert hosts.outputs().coolant == 2


def test_a_host_may_finish_when_the_sender_is_lost(hosts: RemoteHosts) -> None:
    """Nothing of the text side waits, so nothing is held."""
    assert hosts.packet(INPUTS["host_opens"]) == hosts.packet(INPUTS["host_segments"]) == "done"
    hosts.after(5)
    hosts.lose_sender()
    at = hosts.position()[0]
    assert hosts.after(5) == "" and hosts.state() == "Run" and hosts.position()[0] < at
    assert hosts.packet(INPUTS["host_drops"]) == "done"
    hosts.after(SETTLED_S)
    assert hosts.state() == "Idle" and hosts.notice() is None


def test_tools_of_a_lost_sender_stop_when_the_host_is_done(hosts: RemoteHosts) -> None:
    hosts.fine("M3S500")
    assert hosts.packet(INPUTS["host_motion"]) == "done"
    hosts.lose_sender()
    assert HELD in hosts.after(SETTLED_S)
    assert hosts.state() == "Hold:0" and hosts.outputs().spindle_direction == 0


@pytest.mark.parametrize("line", ["G38.3X-90F300", "G1X-90F300"])
def test_an_emergency_stop_before_the_banner_of_a_reset_outlives_it(hosts: RemoteHosts, line: str) -> None:
    """The host's stop comes in the quiet time of ALARM:3. The banner answers the probe, and lines are refused after it
    until a reset that comes after the stop."""
    hosts.after(0.5, f"G91{line}\n")
    said = hosts.after(0.1, "\x18")
    assert hosts.packet(INPUTS["host_estop"]) == "done"
    said += hosts.after(SETTLED_S)
    before, banner, behind = said.partition("Grbl 1.1h")
    assert banner and before.count("ALARM:3\r\n") == before.count("ALARM:50\r\n") == 1
    assert answers(before) == ["ok"] * line.startswith("G38") and answers(behind) == []
    assert "[MSG:Reset to continue]" in behind and "to unlock" not in behind
    assert answers(hosts.after(0.1, "$X\n")) == ["error:9"]
    assert "Grbl 1.1h" in hosts.after(SETTLED_S, "\x18")
    assert answers(hosts.after(0.1, "$X\n")) == ["ok"]
