"""Aircraft in blocks, side by side (`icing_env.lanes`): the equations of `icing_env.dynamics`, a third of the time.

Straight-line equations become vector instructions; what cannot (the equation of the atmosphere itself) is done one by
one for the few aircraft that need it. Numbers are the same to the bit as those of `icing_env.integrate`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from icing_env.dynamics import loads, meet_air, meet_air_near, rates
from icing_env.frames import direction_cosines
from icing_env.integrate import (
    AFTER,
    AHEAD,
    AT,
    BEFORE,
    GUST_RECORDS,
    GUSTS,
    MET,
    RECORDS,
    SLOPE,
    STAGES,
    START,
    TOTAL,
    TRIAL,
    WEIGHT,
    meet_gusts,
    move,
    normalise,
    put,
)
from icing_env.jit import block as apart
from icing_env.jit import kernel
from icing_env.lanes import LANES, lane
from icing_env.parameters import PARAMETERS
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, N_CONTINUOUS

AIR = np.dtype([(name, "f8") for name in (  # what `meet_air` returns
    "density", "static", "airspeed", "alpha", "beta", "sine", "cosine", "ua", "va", "wa", "slowness")])
LOADS = np.dtype([(name, "f8") for name in (  # what `loads` returns
    "fx", "fy", "fz", "roll", "pitch", "yaw", "airspeed", "alpha", "beta", "density", "thrust_left", "thrust_right",
    "hinge_elevator", "hinge_aileron", "static")])
# Rows of a block: the records of `integrate`, the air met, the loads felt, the gusts, and what is held over the step.
NOW, RATES = TRIAL*N_CONTINUOUS, SLOPE*N_CONTINUOUS
AT_AIR = RECORDS*N_CONTINUOUS
AT_LOADS = AT_AIR + len(AIR.names or ())
FAILS = AT_LOADS + len(LOADS.names or ())  # not 0: `meet_air_near` does not hold
N_GUSTS = len(GUSTS.names or ())
FIRST_GUSTS = FAILS + 1
GUSTS_BEFORE, GUSTS_AFTER = FIRST_GUSTS + BEFORE*N_GUSTS, FIRST_GUSTS + AFTER*N_GUSTS
AT_GUSTS = FIRST_GUSTS + MET*N_GUSTS
AT_CURRENT = FIRST_GUSTS + GUST_RECORDS*N_GUSTS
AT_COMMAND = AT_CURRENT + len(CURRENT.names or ())
AT_PARAMETERS = AT_COMMAND + len(COMMAND.names or ())
ROWS = AT_PARAMETERS + len(PARAMETERS.names or ())


@kernel
def fill(block: Any, row: int, j: int, numbers: Any) -> None:
    """Put the numbers of aircraft `j` into a block from a row on."""
    for n in range(len(numbers)):
        block[(row + n)*LANES + j] = numbers[n]


@kernel
def store_air(block: Any, j: int, air: tuple) -> None:
    """Put what `meet_air` returned for aircraft `j` into a block."""
    a = lane(block, AT_AIR, j, AIR)
    (a.density, a.static, a.airspeed, a.alpha, a.beta, a.sine, a.cosine, a.ua, a.va, a.wa, a.slowness) = air


@kernel
def recall_air(block: Any, j: int) -> tuple:
    """What `store_air` put away."""
    a = lane(block, AT_AIR, j, AIR)
    return a.density, a.static, a.airspeed, a.alpha, a.beta, a.sine, a.cosine, a.ua, a.va, a.wa, a.slowness


@kernel
def store_loads(block: Any, j: int, felt: tuple) -> None:
    """Put what `loads` returned for aircraft `j` into a block."""
    f = lane(block, AT_LOADS, j, LOADS)
    (f.fx, f.fy, f.fz, f.roll, f.pitch, f.yaw, f.airspeed, f.alpha, f.beta, f.density, f.thrust_left, f.thrust_right,
     f.hinge_elevator, f.hinge_aileron, f.static) = felt


@kernel
def recall_loads(block: Any, j: int) -> tuple:
    """What `store_loads` put away."""
    f = lane(block, AT_LOADS, j, LOADS)
    return (f.fx, f.fy, f.fz, f.roll, f.pitch, f.yaw, f.airspeed, f.alpha, f.beta, f.density, f.thrust_left,
            f.thrust_right, f.hinge_elevator, f.hinge_aileron, f.static)


@apart
def meet_far_air(block: Any, count: int) -> None:
    """`meet_air` of the aircraft of a block for which `meet_air_near` does not hold."""
    for j in range(count):
        if block[FAILS*LANES + j] != 0.0:
            x = lane(block, NOW, j, CONTINUOUS)
            attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
            store_air(block, j, meet_air(x, attitude, lane(block, AT_GUSTS, j, GUSTS),
                                         lane(block, AT_CURRENT, j, CURRENT),
                                         lane(block, AT_PARAMETERS, j, PARAMETERS)))


@kernel
def meet_air_block(block: Any, count: int) -> None:
    """`meet_air` of every aircraft of a block."""
    for j in range(count):
        x = lane(block, NOW, j, CONTINUOUS)
        air, holds = meet_air_near(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), lane(block, AT_GUSTS, j, GUSTS),
                                   lane(block, AT_CURRENT, j, CURRENT), lane(block, AT_PARAMETERS, j, PARAMETERS))
        store_air(block, j, air)
        block[FAILS*LANES + j] = 0.0 if holds else 1.0
    fails = 0.0
    for j in range(count):
        fails += block[FAILS*LANES + j]
    if fails > 0.0:  # apart, or the compiler would make vectors of what hardly ever runs
        meet_far_air(block, count)


@kernel
def feel_block(block: Any, count: int) -> None:
    """`loads` of every aircraft of a block, in the air that it meets."""
    meet_air_block(block, count)
    for j in range(count):
        felt = loads(lane(block, NOW, j, CONTINUOUS), recall_air(block, j), lane(block, AT_GUSTS, j, GUSTS),
                     lane(block, AT_CURRENT, j, CURRENT), lane(block, AT_PARAMETERS, j, PARAMETERS))
        store_loads(block, j, felt)


@kernel
def rk4_block(block: Any, count: int, dt: float, sub: int, substeps: int) -> None:
    """Advance the first `count` aircraft of a block by `dt` (see `rk4`); their states are in the record TRIAL."""
    size = N_CONTINUOUS*LANES
    put(block, START, TRIAL, size)
    put(block, TOTAL, TRIAL, size)
    for k in range(STAGES):
        meet_gusts(block[FIRST_GUSTS*LANES:], (sub + AT[k])/substeps, N_GUSTS*LANES)
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
