"""An axis that takes a second to stop: its stop needs many spans."""

from __future__ import annotations

from grbl_host import Grbl
from wificnc.simulator.library import Tasks


def test_spans_that_do_not_suffice_are_waited_for() -> None:
    """The motion side refuses batches until some of its spans are stepped; motion continues meanwhile."""
    grbl = Grbl(axes=4, tasks=Tasks.ESP32)
    grbl.send("")
    steps_per_mm, rates, accelerations = (40, 40, 80, 40), (3000, 6000, 600, 30_000), (100, 10_000, 10, 500)
    for axis, values in enumerate(zip(steps_per_mm, rates, accelerations, strict=True)):
        grbl.settings(**{f"s{base + axis}": value for base, value in zip((100, 110, 120), values, strict=True)})
    grbl.settings(s40=200_000)  # 0.8 mm/s2 of Z's 10 are left by it
    answers = grbl.send("F1200\nG1X0Y0Z0\nG1Z1.9\nG1Y-0.35\nG0X-2.9Y0.2Z-2.4A-0.4\n")
    assert answers.count("ok") == 5
    assert grbl.position() == [-116, 8, -192, -16, 0, 0]
    grbl.close()
