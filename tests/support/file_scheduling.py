"""How tests are shared out to workers: whole files, and whole folders whose tests share what they make.

Every second worker begins with the files that wait for browsers, sockets and clocks, and the others with those that
compute: while one waits, another one computes, from the start to the end. Whoever has done its kind helps the others.
"""

from __future__ import annotations

from pathlib import PurePosixPath

from rings import TESTS, Ring, ring_of
from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController

# One release of one repository, and what compilers write in one place of build/.
WHOLE = {f"tests/{name}" for name in ("build", "esp32", "mips", "pic32mz", "release", "xtensa")}

# Files that compile into the folder of another one's tests.
WITH = {f"emulators/tests/espsim/test_espsim_{name}.py": "tests/xtensa" for name in ("cable", "cores", "engines")}


def waits(scope: str) -> bool:
    """The tests of this file wait. A folder of WHOLE has both, and compiles."""
    return scope not in WHOLE and ring_of(TESTS.parent / scope) is Ring.REALTIME


def begins_with_waiting(worker: str) -> bool:
    """Of a worker's name, as gw3."""
    return bool(int(worker.removeprefix("gw")) % 2)


class FileScheduling(LoadScopeScheduling):
    """xdist's scheduling by scope, where a scope is a file, or a folder of WHOLE with its files of WITH."""

    def _split_scope(self, nodeid: str) -> str:
        file = PurePosixPath(nodeid.split("::", 1)[0])
        whole = str(file.parent) if str(file.parent) in WHOLE else str(file)
        return WITH.get(str(file), whole)

    def _assign_work_unit(self, node: WorkerController) -> None:
        """xdist gives the first unit; here it is the first of the worker's kind."""
        wanted = begins_with_waiting(node.gateway.id)
        first = next((scope for scope in self.workqueue if waits(scope) == wanted), None)
        if first is not None:
            self.workqueue.move_to_end(first, last=False)
        super()._assign_work_unit(node)

    def remove_node(self, node: WorkerController) -> str | None:
        """A test that ends its worker, as a timeout does, has failed: the next worker takes what follows it.

        xdist would give it to each new worker again.
        """
        units = self.assigned_work[node]
        unfinished = [(unit, nodeid) for unit in units.values() for nodeid, done in unit.items() if not done]
        if not unfinished:
            return super().remove_node(node)
        unit, crashed = unfinished[0]
        unit[crashed] = True
        super().remove_node(node)
        return crashed
