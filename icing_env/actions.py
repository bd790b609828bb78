"""What an action means: surfaces around the trim, targets for the autopilot, or limits moved; each in [-1, 1].

| axes         | surfaces                            | targets                        | limits                     |
|--------------|-------------------------------------|--------------------------------|----------------------------|
| all          | elevator, aileron, rudder, throttle | climb rate, airspeed, bank     | alpha, airspeed, bank      |
| longitudinal | elevator, throttle                  | climb rate, airspeed           | alpha, airspeed            |
| lateral      | aileron, rudder                     | bank                           | bank                       |

Zero is the trimmed position at the start of the episode, level flight at the task's airspeed, or the limits as the ice
management advises them. What an axis does not cover, and everything in the mode "limits", is flown by the autopilot on
the task's references.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import entry, kernel
from icing_env.memory import matrix, rows
from icing_env.observation import Axes
from icing_env.tasks import TASK
from icing_env.types import ADVISORY, COMMAND, TARGET

ACTION, COLUMN = np.dtype(np.float32), np.dtype(np.int64)
Mode = Literal["surfaces", "targets", "limits"]
ELEVATOR, AILERON, RUDDER, THROTTLE = 0.25, 0.29, 0.28, 1.0  # rad, rad, rad, 1: change at full action
CLIMB_RATE, AIRSPEED, BANK = 8.0, 15.0, math.radians(45.0)  # m/s, m/s, rad at full action
ALPHA_LIMIT, AIRSPEED_LIMIT, BANK_LIMIT = 0.05, 6.0, 0.35  # rad, m/s, rad: shift of a limit at full action
NAMES: dict[str, tuple[str, ...]] = {
    "surfaces": ("elevator", "aileron", "rudder", "throttle"),
    "targets": ("climb_rate", "airspeed", "bank"),
    "limits": ("alpha_limit", "airspeed_limit", "bank_limit"),
}
_AXIS = {"elevator": "longitudinal", "throttle": "longitudinal", "climb_rate": "longitudinal",
         "airspeed": "longitudinal", "aileron": "lateral", "rudder": "lateral", "bank": "lateral",
         "alpha_limit": "longitudinal", "airspeed_limit": "longitudinal", "bank_limit": "lateral"}


def names(mode: Mode, axes: Axes) -> tuple[str, ...]:
    """Names of the actions, in order."""
    return tuple(n for n in NAMES[mode] if axes in ("all", _AXIS[n]))


def columns(mode: Mode, axes: Axes) -> NDArray[np.int64]:
    """Column of the action array for each of NAMES[mode], -1 for those that the axes leave out."""
    kept = names(mode, axes)
    return np.array([kept.index(n) if n in kept else -1 for n in NAMES[mode]])


@kernel
def first_bad_row(action: Any) -> int:
    """Clip the actions in place; index of the first row that holds something not finite, or -1 (nothing changed)."""
    for i in range(action.shape[0]):
        for j in range(action.shape[1]):
            if not math.isfinite(action[i, j]):
                return i
    for i in range(action.shape[0]):
        for j in range(action.shape[1]):
            action[i, j] = min(max(action[i, j], -1.0), 1.0)
    return -1


@kernel
def actions_of(table: Any) -> tuple:
    """The actions [n, covered] and the column of each in them, the first two arrays of a table (`icing_env.memory`)."""
    column = rows(table, 1, COLUMN)
    covered = 0
    for k in range(len(column)):
        covered = max(covered, column[k] + 1)
    return matrix(table, 0, covered, ACTION), column


@entry
def check(table: Any) -> int:
    """`first_bad_row` of the actions of a table."""
    return first_bad_row(actions_of(table)[0])


@entry
def to_surfaces(table: Any) -> int:
    """Surface commands of every row from the action, around the trim; the result of `first_bad_row`.

    Table: actions, columns, trimmed commands, commands.
    """
    action, column = actions_of(table)
    trim, command = rows(table, 2, COMMAND), rows(table, 3, COMMAND)
    bad = first_bad_row(action)
    for i in range(len(command) if bad < 0 else 0):
        c, t = command[i], trim[i]
        if column[0] >= 0:
            c.elevator = t.elevator + ELEVATOR*action[i, column[0]]
        if column[1] >= 0:
            c.aileron = t.aileron + AILERON*action[i, column[1]]
        if column[2] >= 0:
            c.rudder = t.rudder + RUDDER*action[i, column[2]]
        if column[3] >= 0:
            throttle = min(max(t.throttle_left + THROTTLE*action[i, column[3]], 0.0), 1.0)
            c.throttle_left, c.throttle_right = throttle, throttle
    return bad


@entry
def to_targets(table: Any) -> int:
    """Autopilot targets of every row from the action; the result of `first_bad_row`.

    Table: actions, columns, tasks, targets.
    """
    action, column = actions_of(table)
    task, target = rows(table, 2, TASK), rows(table, 3, TARGET)
    bad = first_bad_row(action)
    for i in range(len(target) if bad < 0 else 0):
        g, k = target[i], task[i]
        if column[0] >= 0:
            g.pitch_mode, g.climb_rate = 2.0, CLIMB_RATE*action[i, column[0]]
        if column[1] >= 0:
            g.airspeed = k.start_airspeed + AIRSPEED*action[i, column[1]]
        if column[2] >= 0:
            g.roll_mode, g.phi = 0.0, BANK*action[i, column[2]]
    return bad


@entry
def to_limits(table: Any) -> int:
    """Advised limits of every row shifted by the action, until the ice management states them anew in its next step.

    Limits that nobody has set (no lowest airspeed) stay as they are. Table: actions, columns, advisories. Returns the
    result of `first_bad_row`.
    """
    action, column = actions_of(table)
    advisory = rows(table, 2, ADVISORY)
    bad = first_bad_row(action)
    for i in range(len(advisory) if bad < 0 else 0):
        a = advisory[i]
        if a.airspeed_limit <= 0.0:
            continue
        if column[0] >= 0:
            a.alpha_limit += ALPHA_LIMIT*action[i, column[0]]
        if column[1] >= 0:
            a.airspeed_limit += AIRSPEED_LIMIT*action[i, column[1]]
        if column[2] >= 0:
            a.bank_limit = max(a.bank_limit + BANK_LIMIT*action[i, column[2]], 0.0)
    return bad
