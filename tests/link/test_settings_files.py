"""Settings as a file: every value survives, every mistake is reported with its line."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.connection.settings import (
    Values,
    all_known,
    differences,
    export_text,
    find,
    name_of,
    out_of_range,
    read_file,
    same,
    sending_order,
)
from wificnc.errors import UserError
from wificnc.files.problem import FileProblems
from wificnc.tables import Setting


def value_of(row: Setting) -> st.SearchStrategy[str]:
    if row.type == "bool":
        return st.sampled_from(["0", "1"])
    if row.type == "float":
        return st.integers(0, 10**6).map(lambda value: f"{value / 1000:.{row.decimals}f}")
    return st.integers(0, int(row.max)).map(str)


KNOWN = {entry.number for entry in all_known()}
VALUES = st.fixed_dictionaries({}, optional={entry.number: value_of(entry.row) for entry in all_known()})
OTHERS = st.integers(256, 399).filter(lambda number: number not in KNOWN)


@given(values=VALUES, other=st.dictionaries(OTHERS, st.from_regex(r"[0-9.]{1,5}", fullmatch=True)))
def test_file_round_trip(tmp_path_factory: pytest.TempPathFactory, values: Values, other: Values) -> None:
    path = tmp_path_factory.getbasetemp() / "settings.toml"
    path.write_text(export_text({**values, **other}, "tcp://there"))
    assert read_file(path) == {**values, **other}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[settings]\n", ":1: schema: must be 1"),
        ("schema = 1\n[settings]\nhomming = true\n", ":3: settings.homming: unknown setting homming [unknown-key]\n"
         "  hint: did you mean homing?"),
        ("schema = 1\n[settings]\nhoming = 1\n", ":3: settings.homing: must be true or false"),
        ("schema = 1\n[settings]\nidle_delay_ms = 2.5\n", ":3: settings.idle_delay_ms: must be a whole number"),
        ("schema = 1\n[axis.y]\nsteps_per_mm = 'x'\n", ":3: axis.y.steps_per_mm: must be a number"),
        ("schema = 1\n[axis.q]\nsteps_per_mm = 1\n", ":3: axis.q.steps_per_mm: unknown setting steps_per_mm.q"),
        ("schema = 1\n[setings]\n", ":2: setings: unknown key"),
        ('schema = 1\n[other]\n"37" = "1"\n', ":3: other.37: must be like"),
    ],
)  # fmt: skip
def test_faults_of_a_file(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "settings.toml"
    path.write_text(text)
    with pytest.raises(FileProblems) as error:
        read_file(path)
    assert problem in error.value.message


def test_names_and_numbers() -> None:
    assert find("$110") == find("110") == find("max_rate_mm_min.x") == find("MAX_RATE_mm_min.X") == 110
    assert name_of(131) == "max_travel_mm.y"
    assert name_of(399) == "$399"
    with pytest.raises(UserError, match="has a value for each axis"):
        find("steps_per_mm")


@pytest.mark.parametrize("after", [(45, 55, 65, 85), (5, 10, 15, 18), (30, 35, 70, 75), (10, 45, 50, 90)])
def test_a_laser_curve_ascends_after_each_value(after: tuple[int, ...]) -> None:
    points = {94: "20", 95: "40", 96: "60", 97: "80"}
    wanted = {number: str(value) for number, value in zip(points, after, strict=True)}
    for change in sending_order(differences(points, wanted)):
        points[change.number] = wanted[change.number]
        values = [int(value) for value in points.values()]
        assert values == sorted(set(values))
    assert points == wanted


def test_a_driver_is_given_up_before_another_axis_gets_it() -> None:
    before, after = {210: "6", 211: "0"}, {210: "0", 211: "6"}
    assert [change.number for change in sending_order(differences(before, after))] == [210, 211]
    assert [change.number for change in sending_order(differences(after, before))] == [211, 210]


def test_differences() -> None:
    assert same(110, "5000", "5000.000")
    assert not same(110, "5000", "5000.001")
    changes = differences({0: "3", 22: "1", 110: "500.000"}, {0: "3", 22: "0", 399: "x"})
    assert [(change.number, change.before, change.after) for change in changes] == [
        (22, "1", "0"),
        (110, "500.000", None),
        (399, None, "x"),
    ]
    assert out_of_range(differences({0: "10"}, {0: "0"})) == ["step_pulse_us = 0: must be 1 to 255"]
