"""`wificnc drivers` against a served controller whose board has drivers, and the words for their faults."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest
from click.testing import CliRunner, Result
from patience import HANG_S
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.drivers import parse_driver, scaled_steps, settings_axis
from wificnc.errors import JobError, RefusedError, UserError
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server


def serve(board: str) -> Server:
    return Server(ServeOptions(board=load_board(board), tcp=Address("127.0.0.1", 0), control=0, speed=0.0))


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    with serve("fysetc-e4") as running:
        monkeypatch.setenv("WIFICNC_TO", f"{running.tcp}")
        yield running


def run(*arguments: str) -> Result:
    """A UserError comes out as itself."""
    result = CliRunner().invoke(root, ["drivers", *arguments])
    if isinstance(result.exception, UserError):
        raise result.exception
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    return result


def hands(server: Server, line: str) -> None:
    host, _, port = (server.control or "").rpartition(":")
    with socket.create_connection((host, int(port)), HANG_S) as control, control.makefile() as answers:
        control.sendall(f"{line}\n".encode())
        assert answers.readline().strip() == "ok"


def shown(*arguments: str) -> list[dict[str, object]]:
    found = json.loads(run(*arguments, "--json").stdout)
    assert isinstance(found, list)
    return found


def steps_per_mm(axis: str) -> float:
    return float(CliRunner().invoke(root, ["settings", "get", f"steps_per_mm.{axis}"]).stdout)


def test_it_shows_each_driver(server: Server) -> None:
    rows = shown()
    assert [(row["name"], row["chip"], row["place"]) for row in rows] == [
        ("X", "TMC2209", 1), ("Y", "TMC2209", 3), ("Z", "TMC2209", 0), ("A", "TMC2209", 2),
    ]  # fmt: skip
    assert {row["state"] for row in rows} == {"not written"}
    assert {row["most_ma"] for row in rows} == {1767}, "110 mOhm, as the board file has it"
    words = run().stdout
    assert all(word in words for word in ("motor", "TMC2209", "not written", "1767"))
    assert [row["name"] for row in shown("z")] == ["Z"]


def test_settings_by_name_are_written_and_verified(server: Server) -> None:
    result = run("x", "current_ma=800", "hold_pct=40")
    assert "driver_current_ma.x ($140): 0 -> 800" in result.stderr
    (row,) = shown("x")
    assert (row["state"], row["current_ma"], row["hold_pct"]) == ("verified", 800, 40)


def test_microsteps_keep_a_millimetre_with_steps(server: Server) -> None:
    run("y", "microsteps=32", "--steps")
    assert steps_per_mm("y") == 2 * 250.0
    result = run("y", "microsteps=16")
    assert "250.000 goes with 16 microsteps: --steps" in result.stderr
    assert "home the machine again" in result.stderr


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("q",), "no motor q has a driver with registers"),
        (("x", "current=800"), "unknown setting of a driver: current"),
        (("x", "current_ma"), "is not an assignment"),
        (("x", "current_ma=much"), "is not an assignment"),
        (("x", "current_ma=1768"), "the sense resistor of driver X allows at most 1767 mA"),
        (("x", "hold_pct=101"), "must be 0 to 100"),
        (("x", "microsteps=257"), "microsteps are 1, 2, 4, 8, 16, 32, 64, 128, 256, not 257"),
        (("x", "hold_pct=40", "hold_pct=60"), "hold_pct is given twice"),
        (("x", "--steps"), "--steps needs microsteps"),
        (("x", "hold_pct=40", "--steps"), "--steps needs microsteps"),
        (("hold_pct=40",), "the motor is missing"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_changed(server: Server, words: tuple[str, ...], why: str) -> None:
    with pytest.raises(UserError, match=why) as caught:
        run(*words)
    assert caught.value.exit_code == 2
    assert {row["state"] for row in shown()} == {"not written"}


def test_other_microsteps_than_powers_of_two_change_no_steps_per_mm(server: Server) -> None:
    with pytest.raises(UserError, match="microsteps are 1, 2, 4, 8, 16"):
        run("x", "microsteps=20", "--steps")
    assert steps_per_mm("x") == 250.0


def test_microsteps_may_be_written_as_a_decimal_number(server: Server) -> None:
    result = run("x", "microsteps=32.0", "--steps")
    assert "home the machine again" in result.stderr
    assert steps_per_mm("x") == 2 * 250.0


def test_a_fault_is_exit_code_1_with_its_name(server: Server) -> None:
    run("x", "current_ma=500")
    hands(server, "driver x short")
    with pytest.raises(JobError, match="a driver has a fault"):
        for _ in range(1000):
            with suppress(RefusedError):  # the alarm of the fault itself, if it comes while drivers are asked
                run()
    hands(server, "driver x ok")


def test_in_a_hold_it_names_the_hold(server: Server) -> None:
    """Drivers are asked by a line, and a hold keeps lines waiting; the fault itself may be why it holds."""
    host, _, port = (server.tcp or "").rpartition(":")
    with socket.create_connection((host, int(port)), HANG_S) as sender, sender.makefile() as reports:
        sender.sendall(b"$X\nM0\n")
        while "<Hold" not in (line := reports.readline()):
            assert line
            sender.sendall(b"?")
    with pytest.raises(RefusedError, match="is in state Hold") as caught:
        run("--take")
    assert caught.value.hint


def test_a_board_without_drivers_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    with serve("host") as running:
        monkeypatch.setenv("WIFICNC_TO", f"{running.tcp}")
        with pytest.raises(RefusedError, match="no motor drivers with registers"):
            run()


def test_rows_are_read_or_left_out() -> None:
    row = parse_driver("Y2|TMC5160|3|hot,open|1200|4596|50|256|16|7|2")
    assert row is not None
    assert (row.name, row.state, row.problems, row.resets) == ("Y2", "fault", ("hot", "open"), 2)
    for body in ("", "X|TMC2209|1", "Q|TMC2209|1|ok|1|2|3|4|5|6|7", "X|TMC2209|1|ok|x|2|3|4|5|6|7"):
        assert parse_driver(body) is None


def test_a_second_motor_has_the_settings_of_its_axis() -> None:
    assert settings_axis("Y2", {211: "0"}) == 1
    assert settings_axis("A", {211: "4"}) == 1
    assert settings_axis("A", {211: "0"}) == 3
    assert scaled_steps("320.000", 256, 1) == "1.250"
