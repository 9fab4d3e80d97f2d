"""Profiles of other machines through `wificnc sim` and `wificnc check`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from wificnc.app import main
from wificnc.profile import load_machine

AXES = "".join(
    f"[axis.{axis}]\nsteps_per_mm = 100\nmax_rate_mm_min = 6000\nacceleration_mm_s2 = 500\ntravel_mm = 150\n"
    for axis in "xyz"
)


@pytest.fixture
def cli(tmp_path: Path, capsys):
    def run(command: str, kinematics: str, job: str, *args: str) -> tuple[int, dict]:
        (tmp_path / "m.toml").write_text(f'schema = 1\nname = "M"\n[kinematics]\n{kinematics}\n{AXES}')
        (tmp_path / "job.nc").write_text(job)
        with pytest.raises(SystemExit) as ended:
            main([command, str(tmp_path / "job.nc"), "--machine", str(tmp_path / "m.toml"), "--json", *args])
        return int(ended.value.code or 0), json.loads(capsys.readouterr().out)

    return run


TWO_ARMS = 'type = "scara"\narm_1_mm = 60\narm_2_mm = 50'


def test_a_profile_says_all_of_the_machine(tmp_path):
    (tmp_path / "m.toml").write_text(f'schema = 1\nname = "M"\n[kinematics]\n{TWO_ARMS}\n{AXES}')
    machine = load_machine(tmp_path / "m.toml")
    values = machine.settings()
    assert (values[80], values[81], values[82]) == (3, 60, 50)
    assert machine.travel_mm[:3] == (None, None, 150)


@pytest.mark.parametrize("kinematics", ['type = "corexy"', 'type = "polar"', TWO_ARMS])
def test_the_figures_are_the_tools(cli, kinematics):
    code, report = cli("sim", kinematics, "G0 X60 Y-50\nG1 X60 Y50 F3000\n", "-")
    assert code == 0
    assert report["final_position_mm"]["X"] == pytest.approx(60, abs=0.02)
    assert report["final_position_mm"]["Y"] == pytest.approx(50, abs=0.02)
    assert report["bounding_box_mm"]["min"]["Y"] == pytest.approx(-50, abs=0.05)


def test_a_check_names_every_line_that_cannot_be_reached(cli):
    code, report = cli(
        "check", TWO_ARMS, "G0 X60 Y-50\nG0 X200\nG1 X60 Y50 F3000\nG1 X-60 Y-50\nG2 X60 Y50 I-30 J-25\n"
    )
    assert code == 1
    assert [(f["kind"], f["first_line"]) for f in report["findings"]] == [
        ("refused", 2),
        ("refused", 4),
        ("refused", 5),
    ]
    assert all("error:140" in f["message"] for f in report["findings"])


def test_a_check_judges_feeds_of_the_tool(cli):
    """Round the hub at 100 mm a turn of the table is 628 mm: 6000 deg/min are 10472 mm/min there."""
    circle = "G0 X100\nG3 X100 I-100 F{}\n"
    assert [f["kind"] for f in cli("check", 'type = "polar"', circle.format(9000))[1]["findings"]] == []
    found = cli("check", 'type = "polar"', circle.format(12000))[1]["findings"]
    assert [(f["kind"], f["first_line"]) for f in found] == [("feed-rate", 2)]
