"""How tests are shared out to workers: whole folders, so that what a folder's session builds is built once."""

from __future__ import annotations

from pathlib import PurePosixPath

from xdist.scheduler import LoadScopeScheduling
from xdist.workermanage import WorkerController


class FolderScheduling(LoadScopeScheduling):
    """xdist's scheduling by scope, where a scope is a folder."""

    def _split_scope(self, nodeid: str) -> str:
        return str(PurePosixPath(nodeid.split("::", 1)[0]).parent)

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
