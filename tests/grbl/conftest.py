"""A controller that has said its banner: 3 axes, 250 steps/mm, 5000 mm/min, 500 mm/s2.

Every test that takes `grbl` runs against the host's controller, and against the real image of the PIC32MZ board in the
virtual chip: those of chip_differences.toml's `always` at any time, all of them with WIFICNC_ON_CHIP=all (make
test-chip). A test with a mark `needs` also runs against the host as the boards of ESP_BOARDS: where a board lacks what
it needs, the test must fail (needs.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chip_declared import always, difference
from chip_grbl import ChipGrbl
from esp_grbl import BOARD, IMAGE, EspGrbl
from grbl_host import BANNER, Grbl
from image_fixture import ALL_ON_CHIP, board, build, image
from needs import BoardGrbl, is_needing, lack, loaded, needs_of
from sample import sampled
from wificnc_chips import greet

__all__ = ["board", "build", "image"]

FAST = {f"s{base + ax}": value for base, value in ((110, 5000), (120, 500)) for ax in range(3)}
CHIP_CASES = 6  # in CI, of each test; `make test-chip` and the slices run the others
CHIP = pytest.param("chip", id="chip")
ESP_BOARDS = ("esp32-wroom32", "esp32s3-devkitc")
AS_BOARDS = [pytest.param(name, id=f"pc-{name}") for name in ESP_BOARDS]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "grbl" not in metafunc.fixturenames or hasattr(metafunc.module, "grbl"):
        return  # a module with a fixture of its own wants another machine
    name = f"{Path(metafunc.definition.path).name}::{metafunc.definition.name}"
    on_chip = ALL_ON_CHIP or name in always()
    here = ["host", *([CHIP] if on_chip else []), *(AS_BOARDS if is_needing(metafunc) else [])]
    metafunc.parametrize("grbl", [pytest.param("esp", id="esp")] if IMAGE else here, indirect=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    on_chip = [item for item in items if _is_on_chip(item)]
    kept = sampled([item.nodeid for item in on_chip], CHIP_CASES)
    for item in on_chip:
        item.add_marker(pytest.mark.slow if item.nodeid in kept else pytest.mark.deep)
        name = f"{item.path.name}::{item.name}"
        if reason := difference(name):
            item.add_marker(pytest.mark.xfail(reason=reason, strict=True))
    for item in items:
        where = _controller(item)
        if where not in ("esp", *ESP_BOARDS):
            continue
        if reason := lack(loaded(BOARD if where == "esp" else where), needs_of(item)):
            item.add_marker(pytest.mark.xfail(reason=reason, strict=True))
    items[:] = [item for item in items if _controller(item) not in ESP_BOARDS or needs_of(item)]


def _controller(item: pytest.Item) -> str | None:
    callspec = getattr(item, "callspec", None)
    return None if callspec is None else callspec.params.get("grbl")


def _is_on_chip(item: pytest.Item) -> bool:
    return _controller(item) == "chip"


@pytest.fixture
def grbl(request: pytest.FixtureRequest) -> Iterator[Grbl | ChipGrbl]:
    controller: Grbl | ChipGrbl
    if getattr(request, "param", "host") == "host":
        controller = Grbl()
        controller.send("")
    elif request.param == "esp":
        controller = EspGrbl()
        greeting = greet(controller.chip)
        assert greeting.endswith(BANNER), greeting
        controller.keep(**FAST)
        yield controller
        controller.close()
        return
    elif request.param != "chip":
        controller = BoardGrbl(request.param)
        controller.send("")
    else:
        controller = ChipGrbl(request.getfixturevalue("board"), request.getfixturevalue("image"))
        assert controller.after(0.02) == BANNER
    controller.settings(**FAST)
    yield controller
    controller.close()
