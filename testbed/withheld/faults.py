"""What a recorder or whoever exported a record can do to it, one fault a case, the same in all of its records.

Right is a diagnosis that names the channel among the record's problems (or refuses it by name) and blames nothing on
the aircraft. Some are no fault at all, since formats allow them: a slow channel whose instants differ from the others',
commands that the recorder has between its samples, engines that were not recorded (with levers, or without).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.withheld.draw import SIGMAS, Design, Fault, conditions, published_spread, size_of
from testbed.withheld.effects import EFFECTS
from testbed.withheld.files import COMMANDS

ANGLES = ("alpha", "beta", "p", "q", "r", "phi", "theta", "elevator", "aileron", "rudder")
FORCES = ("ax", "ay", "az")
EVERY = ("airspeed", *ANGLES, *FORCES)
KINDS: dict[str, tuple[str, ...]] = {
    "sign": (*ANGLES, *FORCES), "unit": (*EVERY, "altitude"), "stuck": EVERY, "dropped": EVERY, "blank": EVERY,
    "skew": EVERY, "slow": EVERY, "dropouts": EVERY, "between": ("commands",), "engines": ("engines",),
    "powerless": ("engines",)}  # fmt: skip
SURFACES, LEVERS = COMMANDS[:3], COMMANDS[3:]
ENGINES = ("thrust_left", "thrust_right", "torque_left", "torque_right", "rpm_left", "rpm_right")
FACTORS = {"airspeed": 1.0 / 0.514444, "altitude": 1.0 / 0.3048, **dict.fromkeys(ANGLES, 180.0 / math.pi),
           **dict.fromkeys(FORCES, 1.0 / 9.80665)}  # knots, ft, deg, g
MOST, SHARE = 60, 0.16  # cases: 24 beside 150, 60 beside 2,400
STUCK, SKEW, PAUSE = (8.0, 20.0), (0.2, 0.4), (0.4, 1.5)  # s
BETWEEN = (-1.5, 1.5)  # samples


def fault_count(cases: int) -> int:
    """Records with faults beside a set of `cases`."""
    return min(MOST, round(SHARE * cases))


def fault_designs(cases: int, seed: int) -> list[Design]:
    """Cases beside a set of `cases`: nulls and single effects (in the library's form), kinds of faults in turn."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, cases, 3]))
    found = []
    for k in range(fault_count(cases)):
        kind = tuple(KINDS)[k % len(KINDS)]
        channel = KINDS[kind][int(rng.integers(len(KINDS[kind])))]
        chosen = EFFECTS[int(rng.integers(len(EFFECTS)))]
        parts = ((chosen.name, "same", size_of(chosen, rng)),) if (k // len(KINDS)) % 2 else ()
        sigma = SIGMAS[int(rng.integers(len(SIGMAS)))]
        found.append(Design("faults", parts, *conditions(sigma, rng), published_spread(rng), int(rng.integers(2**62)),
                            fault=Fault(kind, channel, int(rng.integers(2**62)))))
    return found


def excused(channel: str) -> list[str]:
    """Effects that enter at the faulty channel's instrument or surface alone: to name one is no false blame."""
    places = {f"sensor:{channel}", f"{channel}_path"}
    return [effect.name for effect in EFFECTS if set(effect.where) <= places]


def spoiled(channels: dict[str, NDArray], fault: Fault, dt: float) -> dict[str, NDArray]:
    """Channels of a record with the fault in; a dropped one is absent, blanks are nan.

    Args:
        channels: by name, a value at every sample; commands too.
        fault: what is wrong.
        dt: s between samples.
    """
    rng = np.random.default_rng(np.random.SeedSequence([fault.seed]))
    out = dict(channels)
    if fault.kind == "between":
        late = float(rng.uniform(*BETWEEN))
        return out | {name: _late(channels[name], late) for name in SURFACES}
    if fault.kind in ("engines", "powerless"):
        gone = ENGINES + (LEVERS if fault.kind == "powerless" else ())
        return out | {name: np.full_like(channels[name], np.nan) for name in gone}
    x = channels[fault.channel].copy()
    n = len(x)
    if fault.kind == "dropped":
        del out[fault.channel]
        return out
    if fault.kind in ("sign", "unit", "blank"):
        x *= {"sign": -1.0, "unit": FACTORS.get(fault.channel, 1.0), "blank": np.nan}[fault.kind]
    elif fault.kind == "stuck":
        length = round(float(rng.uniform(*STUCK)) / dt)
        first = int(rng.integers(1, n - length))
        x[first : first + length] = x[first]
    elif fault.kind == "skew":
        late = round(float(rng.uniform(*SKEW)) / dt)
        x = np.concatenate([np.full(late, x[0]), x[:-late]])
    elif fault.kind == "slow":
        kept = np.cumsum(rng.integers(4, 7, n))
        x[~np.isin(np.arange(n), kept)] = np.nan
    elif fault.kind == "dropouts":
        for first in rng.integers(0, n, int(rng.integers(3, 7))):
            x[first : first + round(float(rng.uniform(*PAUSE)) / dt)] = np.nan
    else:
        raise ValueError(fault.kind)
    return out | {fault.channel: x}


def _late(x: NDArray, samples: float) -> NDArray:
    """What a recorder has that is so many samples late, in straight lines between its own."""
    at = np.arange(len(x), dtype=np.float64)
    return np.interp(at - samples, at, x)
