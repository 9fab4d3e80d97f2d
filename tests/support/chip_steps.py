"""Steps of a virtual ESP32 next to the PC's, axis by axis.

How far a batch of motion reaches depends on how long the task side has worked on it, which the model of caches decides.
Batches that end at other places make the same steps, but a step of a slower axis may go to another event of the fastest
one, and times between steps differ a little.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

AXES = 4
REST_NS = 20_000_000  # between motions
LATE_TASK_NS = 20_000  # what times between steps differ by when batches end at other places

Events = NDArray[np.int64]  # rows of time, step mask, direction mask


def _made(events: Events, axis: int) -> NDArray[np.bool_]:
    return (events[:, 1] >> axis & 1) == 1


def assert_same_steps(pc: Events, chip: Events) -> None:
    """Of each axis, with their directions, in their order."""
    assert len(pc) > 0
    for axis in range(AXES):
        mine, its = pc[_made(pc, axis)], chip[_made(chip, axis)]
        assert len(mine) == len(its)
        np.testing.assert_array_equal(its[:, 2] >> axis & 1, mine[:, 2] >> axis & 1)


def assert_steps_in_time(pc: Events, chip: Events, ns_per_cycle: float, allowed_ns: float) -> None:
    """The same steps, each as late as the others of its axis in its motion, which begins when its line has come.

    @param pc  times in ns @param chip  times in cycles @param allowed_ns  in addition to LATE_TASK_NS
    """
    assert_same_steps(pc, chip)
    gaps_ns = np.diff(pc[:, 0])
    ends_ns = pc[:-1, 0][gaps_ns > REST_NS]
    near_ns = np.where(gaps_ns > REST_NS, 0, gaps_ns)
    to_next_ns = np.maximum(np.append(near_ns, 0), np.insert(near_ns, 0, 0))
    is_diagonal = int(np.bitwise_or.reduce(pc[:, 1])).bit_count() > 1
    for axis in range(AXES):
        mine, its = pc[_made(pc, axis), 0], chip[_made(chip, axis), 0]
        late_ns = (its - chip[0, 0]) * ns_per_cycle - (mine - pc[0, 0])
        most_ns = LATE_TASK_NS + allowed_ns + (to_next_ns[_made(pc, axis)] if is_diagonal else np.zeros(len(mine)))
        motion = np.searchsorted(ends_ns, mine)
        for each in np.unique(motion):
            late = late_ns[motion == each]
            assert (np.abs(late - np.median(late)) <= most_ns[motion == each]).all()
