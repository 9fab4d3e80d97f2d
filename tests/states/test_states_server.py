"""Lines that the network's server answers, in every state: they come in their client's turn."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from generate.states_table import load_states
from hub_hosts import HubHosts
from slow import slow_but
from state_machine import REACHED_S, SITUATIONS, Pair, answers
from state_model import PARKED

TABLE = load_states()
LINE = TABLE.inputs["server_line"].server
LISTED = "[TRUST:1,10.0.0.255,always]\r\nok\r\n"
WHO = (255 << 0) | (10 << 24) | (0xFFFF << 32)
# lines that change no setting and are answered soon, where lines are read at all
AROUND = ("$I\n", "$Z\n", "$G\n", "G999\n")


class ServerPair(Pair):
    """The controller behind a server."""

    def start(self) -> HubHosts:
        grbl = HubHosts()
        grbl._access.trust[0].who, grbl._access.trust[0].end_us = WHO, 2**64 - 1
        grbl.heard()
        grbl.fine("$747=1")
        return grbl

    def drive(self, name: str) -> str:
        line = self.table.inputs[name].server
        if line:
            self.grbl.put(line + "\n")
            return ""
        return super().drive(name)

    @property
    def server(self) -> HubHosts:
        assert isinstance(self.grbl, HubHosts)
        return self.grbl

    @property
    def waits(self) -> bool:
        """A line of the client is not answered yet that is answered first."""
        model = self.model
        return bool(self.jobs_first or model.probes or model.aside)

    @property
    def jobs_first(self) -> int:
        """Lines that are answered before one of the client: in a parked hold it is the operator's, behind which the
        job's are answered."""
        model = self.model
        operates = model.state in PARKED and not model.lines_ended
        return 0 if operates else int(model.open_line) + len(model.waiting)


@pytest.fixture
def pair() -> Iterator[ServerPair]:
    made = ServerPair(TABLE)
    yield made
    made.close()


@pytest.mark.parametrize("situation", SITUATIONS)
def test_it_is_answered_as_the_table_says(pair: ServerPair, situation: str) -> None:
    pair.reach(situation)
    rule = pair.model.rule("server_line")
    assert (rule.answer == "waits") == pair.waits
    said = pair.grbl.after(0.5, LINE + "\n")
    assert ("TRUST" in said) == (rule.answer == "ok"), said
    assert rule.answer == "waits" or said.endswith(LISTED)


def in_turn(said: str) -> list[str]:
    """One word for each answer: that of the server's line, or another."""
    return [
        "server" if listed else "line" for listed in re.findall(r"(\[TRUST:.*\]\r\n)?^(?:ok|error:\d+)\r$", said, re.M)
    ]


@pytest.mark.parametrize("onward", ["resume_byte", "cancel_byte", "unlock", "spindle_off"])
@pytest.mark.parametrize("situation", slow_but(lambda name: "," not in name, SITUATIONS))
def test_answers_are_in_the_order_of_lines_whatever_comes_next(pair: ServerPair, situation: str, onward: str) -> None:
    pair.reach(situation)
    model, first = pair.model, pair.jobs_first
    last = int(model.open_line) + len(model.waiting) - first
    sent = ["line"] * (first + int(model.probes) + len(model.aside))
    said = ""
    for line in AROUND:
        said += pair.grbl.after(0, f"{line}{LINE}\n")
        sent += ["line", "server"]
    entry = TABLE.inputs[onward]
    sent += ["line"] * (entry.line is not None)
    said += pair.grbl.after(REACHED_S, f"{entry.line}\n" if entry.line is not None else chr(next(entry.all_bytes())))
    said += pair.grbl.after(9)
    found = in_turn(said)
    sent += ["line"] * last
    assert found == sent[: len(found)], said


@pytest.mark.parametrize("situation", ["run, dwell", "hold, M0", "parked_moves, probe", "home", "run, line open"])
def test_a_reset_forgets_it_with_the_lines_before_it(pair: ServerPair, situation: str) -> None:
    pair.reach(situation)
    assert pair.waits or pair.model.state == "home"
    assert "TRUST" not in pair.grbl.after(0.1, f"G1X1F100\n{LINE}\n")
    said = pair.grbl.after(2, "\x18")
    assert "TRUST" not in said and "Grbl 1.1h" in said
    assert pair.grbl.after(0.1, LINE + "\n").endswith(LISTED)


def test_a_full_receive_buffer_keeps_the_order(pair: ServerPair) -> None:
    """More than the controller, the planner and the server's queue have room for."""
    pair.reach("hold, M0")
    lines = [f"G999N{number}X{'1' * 60}\n{LINE}\n" for number in range(400)]
    said = pair.grbl.after(0.5, "".join(lines))
    assert "TRUST" not in said
    pair.grbl.input("start", True)  # a ~ would be behind the lines
    said = pair.grbl.after(60)
    assert in_turn(said) == ["line", *["line", "server"] * len(lines)]


def test_an_observer_is_answered_whatever_the_owner_waits_for(pair: ServerPair) -> None:
    pair.reach("hold, M0")
    grbl = pair.server
    grbl.after(0.1, f"G1X1F100\n{LINE}\n")
    grbl.heard_of(1)
    grbl.put_of(1, f"{LINE}\nG1X2\n$RI=0\n{LINE}\n")
    assert answers(grbl.heard_of(1)) == ["ok", "error:181", "ok", "ok"]


def test_a_login_does_not_wait_for_lines_of_others_that_a_hold_keeps(pair: ServerPair) -> None:
    pair.reach("hold, M0")
    grbl = pair.server
    grbl.after(0.1, "G1X1F100\n" * 200)
    grbl.lose_client(0)
    grbl.put_of(1, "?")
    grbl.heard_of(1)
    grbl.put_of(1, f"$LOGIN=x\n{LINE}\n")
    assert grbl.heard_of(1).endswith(f"ok\r\n{LISTED}")


def test_a_former_owners_answers_are_in_the_order_of_its_lines(pair: ServerPair) -> None:
    """It was answered before it lost control but for one line, and asks as an observer."""
    pair.reach("hold, M0")
    grbl = pair.server
    grbl.after(0.1, "G1X1F100\n")
    grbl.put_of(1, "$TAKE\n")
    assert "TRUST" not in grbl.after(1, f"{LINE}\n")
    grbl.put_of(1, "~")
    said = grbl.after(5)
    found = in_turn(said)
    assert found.count("server") == 1 and found.index("server") >= len(["M0", "G1"]), said
