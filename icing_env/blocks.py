"""Aircraft in blocks, side by side (`icing_env.lanes`): the equations of `icing_env.dynamics`, a third of the time.

Straight-line equations become vector instructions; what cannot (the equation of the atmosphere itself) is done one by
one for the few aircraft that need it. Numbers are the same to the bit as those of `icing_env.integrate`.
"""

from __future__ import annotations

from typing import Any

from icing_env.dynamics import loads, meet_air, meet_air_near, rates
from icing_env.frames import direction_cosines
from icing_env.integrate import AHEAD, RECORDS, SLOPE, STAGES, START, TOTAL, TRIAL, WEIGHT, move, normalise, put
from icing_env.jit import kernel
from icing_env.lanes import LANES, lane
from icing_env.parameters import PARAMETERS
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, GUST_FIELDS, N_CONTINUOUS, structured

GUSTS = structured(GUST_FIELDS[:7])
N_AIR, N_LOADS = 11, 15  # numbers that `meet_air` and `loads` return
# Rows of a block: the records of `integrate`, the air met, the loads felt, and what is held over the step.
NOW, RATES = TRIAL*N_CONTINUOUS, SLOPE*N_CONTINUOUS
AIR = RECORDS*N_CONTINUOUS
LOADS = AIR + N_AIR
FAILS = LOADS + N_LOADS  # not 0: `meet_air_near` does not hold
AT_GUSTS = FAILS + 1
AT_CURRENT = AT_GUSTS + len(GUSTS.names or ())
AT_COMMAND = AT_CURRENT + len(CURRENT.names or ())
AT_PARAMETERS = AT_COMMAND + len(COMMAND.names or ())
ROWS = AT_PARAMETERS + len(PARAMETERS.names or ())


@kernel
def fill(block: Any, row: int, j: int, numbers: Any) -> None:
    """Put the numbers of aircraft `j` into a block from a row on."""
    for n in range(len(numbers)):
        block[(row + n)*LANES + j] = numbers[n]


@kernel
def copy_gusts(out: Any, s: Any) -> None:
    """The gusts of a STATE record."""
    out.gust_u, out.gust_v, out.gust_w, out.gust_w_tail = s.gust_u, s.gust_v, s.gust_w, s.gust_w_tail
    out.gust_p, out.gust_q, out.gust_r = s.gust_p, s.gust_q, s.gust_r


@kernel
def store(block: Any, row: int, j: int, values: tuple) -> None:
    """Put what a kernel returned for aircraft `j` into a block from a row on."""
    for n in range(len(values)):
        block[(row + n)*LANES + j] = values[n]


@kernel
def recall_air(block: Any, j: int) -> tuple:
    """The numbers of `meet_air` of one aircraft."""
    a = AIR*LANES + j
    return (block[a], block[a + LANES], block[a + 2*LANES], block[a + 3*LANES], block[a + 4*LANES],
            block[a + 5*LANES], block[a + 6*LANES], block[a + 7*LANES], block[a + 8*LANES], block[a + 9*LANES],
            block[a + 10*LANES])


@kernel
def recall_loads(block: Any, j: int) -> tuple:
    """The numbers of `loads` of one aircraft."""
    a = LOADS*LANES + j
    return (block[a], block[a + LANES], block[a + 2*LANES], block[a + 3*LANES], block[a + 4*LANES],
            block[a + 5*LANES], block[a + 6*LANES], block[a + 7*LANES], block[a + 8*LANES], block[a + 9*LANES],
            block[a + 10*LANES], block[a + 11*LANES], block[a + 12*LANES], block[a + 13*LANES], block[a + 14*LANES])


@kernel
def meet_air_block(block: Any, count: int) -> None:
    """`meet_air` of every aircraft of a block: the straight-line form for all, then the few for which it fails."""
    for j in range(count):
        x = lane(block, NOW, j, CONTINUOUS)
        air, holds = meet_air_near(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), lane(block, AT_GUSTS, j, GUSTS),
                                   lane(block, AT_CURRENT, j, CURRENT), lane(block, AT_PARAMETERS, j, PARAMETERS))
        store(block, AIR, j, air)
        block[FAILS*LANES + j] = 0.0 if holds else 1.0
    for j in range(count):
        if block[FAILS*LANES + j] != 0.0:
            x = lane(block, NOW, j, CONTINUOUS)
            air = meet_air(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), lane(block, AT_GUSTS, j, GUSTS),
                           lane(block, AT_CURRENT, j, CURRENT), lane(block, AT_PARAMETERS, j, PARAMETERS))
            store(block, AIR, j, air)


@kernel
def feel_block(block: Any, count: int) -> None:
    """`loads` of every aircraft of a block, in the air that it meets."""
    meet_air_block(block, count)
    for j in range(count):
        felt = loads(lane(block, NOW, j, CONTINUOUS), recall_air(block, j), lane(block, AT_GUSTS, j, GUSTS),
                     lane(block, AT_CURRENT, j, CURRENT), lane(block, AT_PARAMETERS, j, PARAMETERS))
        store(block, LOADS, j, felt)


@kernel
def rk4_block(block: Any, count: int, dt: float) -> None:
    """Advance the first `count` aircraft of a block by `dt`; the continuous state is in the record TRIAL."""
    size = N_CONTINUOUS*(len(block)//ROWS)  # LANES, but not known to the compiler: see `put`
    put(block, START, TRIAL, size)
    put(block, TOTAL, TRIAL, size)
    for k in range(STAGES):
        meet_air_block(block, count)
        for j in range(count):
            x = lane(block, NOW, j, CONTINUOUS)
            rates(x, lane(block, RATES, j, CONTINUOUS), direction_cosines(x.e0, x.e1, x.e2, x.e3),
                  recall_air(block, j), lane(block, AT_GUSTS, j, GUSTS), lane(block, AT_CURRENT, j, CURRENT),
                  lane(block, AT_PARAMETERS, j, PARAMETERS), lane(block, AT_COMMAND, j, COMMAND))
        move(block, AHEAD[k]*dt, WEIGHT[k]*dt, size)
    put(block, TRIAL, TOTAL, size)
    for j in range(count):
        normalise(lane(block, NOW, j, CONTINUOUS))
