"""The end of a step: what was asked and done is judged, and seen.

The arrays come by address (`icing_env.memory`), in the order in which `World` writes them into the table.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from icing_env.jit import entry, kernel
from icing_env.memory import matrix, rows
from icing_env.observation import N_BOUNDS, gather
from icing_env.parameters import PARAMETERS
from icing_env.tasks import TASK, WEIGHTS, judge, measure_errors, refer
from icing_env.types import ADVISORY, COMMAND, CURRENT, ESTIMATE, MEASUREMENT, OUTCOME, STATE, TARGET

NUMBER, SEEN, INDEX = np.dtype(np.float64), np.dtype(np.float32), np.dtype(np.int64)
N_MEASUREMENT, N_TASK = len(MEASUREMENT.names or ()), len(TASK.names or ())
N_ESTIMATE, N_ADVISORY = len(ESTIMATE.names or ()), len(ADVISORY.names or ())


@kernel
def sights(table: Any) -> tuple:
    """What observations are gathered from, the first of a table: numbers of four records, layout, scaling, room."""
    layout = rows(table, 4, INDEX)
    return (matrix(table, 0, N_MEASUREMENT, NUMBER), matrix(table, 1, N_TASK, NUMBER),
            matrix(table, 2, N_ESTIMATE, NUMBER), matrix(table, 3, N_ADVISORY, NUMBER), layout,
            matrix(table, 5, layout[N_BOUNDS - 1], NUMBER),
            matrix(table, 6, layout[N_BOUNDS - 1], SEEN))


@entry
def conclude(table: Any) -> None:
    """After a step, for every row: its count, references, errors, rewards, ending, observation."""
    measurement, task = rows(table, 0, MEASUREMENT), rows(table, 1, TASK)
    target, weights = rows(table, 7, TARGET), rows(table, 8, WEIGHTS)
    state, outcome, current = rows(table, 9, STATE), rows(table, 10, OUTCOME), rows(table, 11, CURRENT)
    command, parameters = rows(table, 12, COMMAND), rows(table, 13, PARAMETERS)
    shared, seen = len(parameters) == 1, sights(table)
    for i in range(len(task)):
        refer(task[i], target[i], measurement[i].time)
        measure_errors(task[i], target[i], measurement[i])
        judge(task[i], weights[0], state[i], outcome[i], current[i], command[i], parameters[0 if shared else i])
        gather(i, *seen)


@entry
def look(table: Any) -> None:
    """Observation of every row."""
    seen = sights(table)
    for i in range(len(seen[0])):
        gather(i, *seen)
