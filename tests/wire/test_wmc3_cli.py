"""What `wificnc wmc3` says: JSON as scripts read it, and errors that say what, where and what to do."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from click.testing import CliRunner
from patience import HANG_S
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.commands.wmc3 import SLICES_MAX, parse_moves, slices
from wificnc.connection.wmc3.device import Device, find_key, pack_value
from wificnc.connection.wmc3.layout import Refusal, Resume, Type
from wificnc.connection.wmc3.refused import refused_error
from wificnc.errors import RefusedError, UserError
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

ADDRESS = f"127.61.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"
NOBODY = "127.61.255.254"


@pytest.fixture(scope="module")
def controller() -> Iterator[None]:
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS), "release"):
        yield


def invoke(*arguments: str, to: str = ADDRESS) -> str:
    result = CliRunner().invoke(root, ["wmc3", arguments[0], "--to", to, *arguments[1:]])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def told(*arguments: str, to: str = ADDRESS) -> tuple[str, str]:
    """The error of a command: what, and what to do."""
    with pytest.raises(UserError) as raised:
        invoke(*arguments, to=to)
    return str(raised.value), raised.value.hint or ""


# ---- JSON ----


@pytest.mark.parametrize(
    ("command", "types"),
    [
        (["handshake"], {"version": str, "axes": int, "capabilities": list, "device_name": str}),
        (["status"], {"position_steps": list, "state": str, "alarm": str, "flags": list, "uptime_ms": int}),
        (["counters"], {"datagrams": int, "last_refusal": str, "owner": str, "done": int}),
        (["config"], {"steps_per_mm.x": float, "status_interval_ms": int, "wifi_ssid": str}),
        (["config", "status_interval_ms"], {"status_interval_ms": int}),
        (["config", "status_interval_ms", "40"], {"status_interval_ms": int}),
        (["motion", "X=100"], {"segments": int, "executed": int, "underruns": int, "datagrams": int}),
        (["bench", "--requests", "10", "--seconds", "0.5"], {"round_trip_median_ms": float, "method": str}),
    ],
    ids=lambda value: "-".join(value[:3]) if isinstance(value, list) else "",
)
@pytest.mark.usefixtures("controller")
def test_json_is_one_object_and_nothing_else(command: list[str], types: dict[str, type]) -> None:
    document = json.loads(invoke(*command, "--json"))
    assert {name: type(document[name]) for name in types} == types


@pytest.mark.usefixtures("controller")
def test_discover_says_by_its_exit_code_whether_there_is_one() -> None:
    def run(address: str) -> Any:
        return CliRunner().invoke(root, ["wmc3", "discover", "--broadcast", address, "--seconds", "0.3", "--json"])

    found, none = run(ADDRESS), run(NOBODY)
    assert json.loads(found.stdout) == [{"address": ADDRESS, "state": "idle"}] and found.exit_code == 0
    assert json.loads(none.stdout) == [] and none.exit_code == 1
    assert "no device has answered" in none.stderr


# ---- errors ----


@pytest.mark.parametrize(
    ("command", "what", "hint"),
    [
        (["config", "status_interval_ms", "5"], ["status_interval_ms = 5", "range"], "10 to 1000 ms"),
        (["config", "io_debounce_ms", "61"], ["io_debounce_ms = 61", "range"], "0 to 60 ms"),
        (["config", "status_interval_ms", "12.7"], ["'12.7' is not a value of status_interval_ms"], "whole number"),
        (["config", "steps_per_mm.x", "1e99"], ["'1e99' is not a value of steps_per_mm"], "a number"),
        (["config", "misc_input_pin.0", "3"], ["misc_input_pin.0 = 3", "read_only"], "boards/"),
        (["config", "step_pin.x", "255"], ["step_pin.x = 255", "pin"], "free pins"),
        (["config", "wifi_password", "short"], ["wifi_password = short", "range"], "it is text"),
        (["config", "status_intervall_ms"], ["unknown key 'status_intervall_ms'"], "did you mean status_interval_ms?"),
        (["config", "nonsense"], ["unknown key 'nonsense'"], "wificnc wmc3 config lists all"),
        (["config", "0xZZ"], ["unknown key '0xZZ'"], "lists all"),
        (["config", "steps_per_mm", "250"], ["'steps_per_mm' is not one key"], "steps_per_mm.x to steps_per_mm.c"),
        (["config", "io_pin.16"], ["unknown key 'io_pin.16'"], "io_pin.0 to io_pin.15"),
        (["config", "device_mode.x"], ["unknown key 'device_mode.x'"], "device_mode"),
        (["home", "XY"], ["home", "no_homing"], "$22=1"),
        (["home", "XQ"], ["'Q' is not an axis"], "one of X Y Z A B C"),
        (["jog", "X", "0", "1"], ["speed of a jog must not be 0"], "other direction"),
        (["motion", "X=1", "x=2"], ["X is given twice"], "one move of each axis"),
        (["motion", "X=1e3"], ["'X=1e3' is not a move"], "like X=1000"),
        (["motion", "X=9999999999"], ["too far"], "2147483647"),
        (["motion", "X=100", "--speed", "1e8"], ["too_fast", "segment 0"], "plan slower"),
        (["output", "0", "on"], ["channel_outputs", "unknown_type"], "I/O module"),
        (["resume"], ["resume", "busy"], "nothing is held"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, list) else "",
)
@pytest.mark.usefixtures("controller")
def test_an_error_says_what_and_what_to_do(command: list[str], what: list[str], hint: str) -> None:
    message, advice = told(*command)
    assert [word for word in what if word not in message] == []
    assert hint in advice


@pytest.mark.parametrize("command", [["handshake"], ["status"], ["config"], ["motion", "X=1"], ["jog", "X", "1", "0"]])
def test_nobody_there_is_told_with_the_address(command: list[str]) -> None:
    message, hint = told(*command, to=NOBODY)
    assert NOBODY in message and "wificnc wmc3 discover" in hint


@pytest.mark.usefixtures("controller")
def test_a_key_that_nobody_wants_does_no_harm() -> None:
    """WIFICNC_KEY is that of another device."""
    for _ in range(2):
        assert json.loads(invoke("handshake", "--key", "of another device", "--json"))["device_name"] == "WiFiCNC"


def test_a_wrong_key_says_that_the_next_answer_is_late() -> None:
    error = refused_error(Type.AUTHENTICATE, Refusal.AUTHENTICATION)
    assert "wrong access key" in str(error) and "later" in (error.hint or "")


def test_a_locked_device_leads_to_the_options_that_log_in() -> None:
    """It led to --password and WIFICNC_PASSWORD, which are none."""
    hint = refused_error(Type.JOG, Refusal.AUTHENTICATION).hint or ""
    words = CliRunner().invoke(root, ["wmc3", "jog", "--help"]).output
    assert "wificnc login" in hint
    for option in re.findall(r"--[a-z]+|WIFICNC_[A-Z]+", hint) or ["none"]:
        assert option in words


@pytest.mark.parametrize("reason", [reason for reason in Refusal if reason != Refusal.NONE])
def test_every_refusal_has_words_and_a_hint(reason: Refusal) -> None:
    error = refused_error(Type.CONFIG_SET, reason, "io_pin.3 = 20")
    assert reason.name.lower() in str(error) and "config_set of io_pin.3 = 20" in str(error)
    assert len(error.hint or "") > 10


def test_a_refusal_of_a_newer_device() -> None:
    assert "reason 99" in str(refused_error(Type.HOME, 99))


@pytest.mark.usefixtures("controller")
def test_motion_in_a_hold_says_that_it_waits() -> None:
    """It waited without a word."""
    invoke("hold")

    def resume_when_it_waits() -> None:
        with Device(ADDRESS) as other:
            assert any(report.buffer_free < report.buffer_total for report in other.reports(HANG_S))
            other.command(Resume())

    with ThreadPoolExecutor(1) as pool:
        resumed = pool.submit(resume_when_it_waits)
        result = CliRunner().invoke(root, ["wmc3", "motion", "X=10", "--to", ADDRESS])
        resumed.result(HANG_S)
    assert result.exit_code == 0 and "wificnc wmc3 resume" in result.stderr


# ---- moves ----


def test_a_very_long_move_has_longer_slices() -> None:
    made = slices(parse_moves(("X=2147483647",)), 1000.0)
    assert len(made) == SLICES_MAX and sum(segment.steps[0] for segment in made) == 2147483647
    assert sum(segment.duration_us for segment in made) == pytest.approx(2147483647 / 1000 * 1e6, rel=1e-6)


def test_keys_by_name_and_number() -> None:
    assert find_key("max_rate_mm_min.B")[0] == find_key("0x0014")[0] == find_key("max_rate_mm_min.4")[0] == 0x0014
    assert find_key("misc_input_pin.3")[0] == 0x0533
    with pytest.raises(RefusedError):
        pack_value(find_key("device_mode")[1], "256")
