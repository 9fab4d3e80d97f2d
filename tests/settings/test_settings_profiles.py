"""Every machine profile that comes with WiFiCNC, typed into the core line by line."""

from __future__ import annotations

import pytest
from settings_core import Settings
from wificnc.profile import find_machines, load_machine


@pytest.mark.parametrize("name", find_machines())
def test_the_core_accepts_a_profile_in_its_order_and_keeps_its_values(settings: Settings, name: str) -> None:
    machine = load_machine(name)
    for line in machine.settings_lines():
        number, text = line[1:].split("=")
        assert settings.set(int(number), float(text), axes=machine.axis_count) == 0, line
    for number, value in machine.settings().items():
        assert settings.value(number) == pytest.approx(float(value), rel=1e-7), number


def test_a_profile_of_four_axes_needs_four_axes(settings: Settings) -> None:
    lines = load_machine("rotary_4axis").settings_lines()
    refused = [line for line in lines if settings.set(int(line[1:].split("=")[0]), 1, axes=3) != 0]
    assert [line[:4] for line in refused] == ["$103", "$113", "$123", "$133"]
