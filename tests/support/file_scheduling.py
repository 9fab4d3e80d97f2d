"""How tests are shared out to workers: whole files, and whole folders whose tests share what they make."""

from __future__ import annotations

from pathlib import PurePosixPath

from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController

# One release of one repository, and what compilers write in one place of build/.
WHOLE = {f"tests/{name}" for name in ("build", "esp32", "mips", "pic32mz", "release", "xtensa")}

# Files that compile into the folder of another one's tests.
WITH = {f"tests/espsim/test_espsim_{name}.py": "tests/xtensa" for name in ("cable", "cores", "engines")}


class FileScheduling(LoadScopeScheduling):
    """xdist's scheduling by scope, where a scope is a file, or a folder of WHOLE with its files of WITH."""

    def _split_scope(self, nodeid: str) -> str:
        file = PurePosixPath(nodeid.split("::", 1)[0])
        whole = str(file.parent) if str(file.parent) in WHOLE else str(file)
        return WITH.get(str(file), whole)

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
