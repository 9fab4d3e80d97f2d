"""A test that ends its worker (a timeout does) is not given to the next worker, and those behind it are."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from types import SimpleNamespace

from file_scheduling import FileScheduling, waits
from rings import ROOT, files_of_tests

UNIT = ["tests/gcode/test_x.py::one", "tests/gcode/test_x.py::two", "tests/gcode/test_y.py::three"]


class Worker(SimpleNamespace):
    """What the scheduler does with a worker process."""

    shutting_down = False
    gateway = SimpleNamespace(id="gw0")

    def __hash__(self) -> int:
        return id(self)

    def send_runtest_some(self, indices: list[int]) -> None:
        self.sent = [*self.sent, *indices]

    def shutdown(self) -> None:
        self.shutting_down = True


def scheduling(done: dict[str, bool]) -> tuple[FileScheduling, Worker, Worker]:
    """One worker has the unit, of which that much is done; another one has nothing."""
    scheduler = FileScheduling.__new__(FileScheduling)
    crashing, other = Worker(sent=[]), Worker(sent=[])
    scheduler.log = lambda *words: None
    scheduler.workqueue = OrderedDict()
    scheduler.assigned_work = {crashing: OrderedDict({"tests/gcode": OrderedDict(done)}), other: OrderedDict()}
    scheduler.registered_collections = {crashing: UNIT, other: UNIT}
    return scheduler, crashing, other


def test_next_worker_begins_after_the_test_that_crashed() -> None:
    scheduler, crashing, other = scheduling({UNIT[0]: True, UNIT[1]: False, UNIT[2]: False})
    assert scheduler.remove_node(crashing) == UNIT[1]
    assert other.sent == [2]


def test_crash_in_the_last_test_is_its_failure() -> None:
    scheduler, crashing, other = scheduling({UNIT[0]: True, UNIT[1]: True, UNIT[2]: False})
    assert scheduler.remove_node(crashing) == UNIT[2]
    assert other.sent == []


def test_worker_that_ends_when_all_is_done_has_no_crash() -> None:
    scheduler, crashing, other = scheduling(dict.fromkeys(UNIT, True))
    assert scheduler.remove_node(crashing) is None
    assert other.sent == []


def test_half_of_the_workers_begin_with_what_waits() -> None:
    """And when nothing of their kind is left, they take the other's."""
    files = [
        f"tests/{name}.py" for name in ("gcode/test_arcs", "web/test_page", "gcode/test_modal", "gcode/test_plane")
    ]
    assert [waits(file) for file in files] == [False, True, False, False]
    scheduler, computes, waiter = scheduling({})
    waiter.gateway = SimpleNamespace(id="gw1")
    names = [f"{file}::test" for file in files]
    scheduler.registered_collections = {computes: names, waiter: names}
    scheduler.workqueue = OrderedDict((file, {name: False}) for file, name in zip(files, names, strict=True))
    for worker in (computes, waiter, waiter, computes):
        scheduler._assign_work_unit(worker)
    assert (computes.sent, waiter.sent) == ([0, 3], [1, 2])


def test_a_scope_is_a_file_or_a_folder_that_shares_what_it_makes() -> None:
    scheduler, _, _ = scheduling({})
    assert [scheduler._split_scope(test) for test in UNIT] == ["tests/gcode/test_x.py"] * 2 + ["tests/gcode/test_y.py"]
    of_a_release = [f"tests/release/test_{name}.py::test" for name in ("wheels", "installed")]
    assert [scheduler._split_scope(test) for test in of_a_release] == ["tests/release"] * 2


def test_files_that_compile_into_one_folder_are_one_scope() -> None:
    """Two workers would read each other's half of a file: each that builds a program for Xtensa in build/."""
    scheduler = FileScheduling.__new__(FileScheduling)
    files = (path for path in files_of_tests() if path != Path(__file__).resolve())
    builders = [path for path in files if "windows.missing(" in path.read_text()]
    scopes = {
        str(path.relative_to(ROOT)): scheduler._split_scope(f"{path.relative_to(ROOT)}::test_x") for path in builders
    }
    own = {name for name in scopes if name.endswith("test_espsim_rom.py")}  # it compiles into a folder of its own
    assert {scope for name, scope in scopes.items() if name not in own} == {"tests/xtensa"}
