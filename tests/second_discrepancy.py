"""What no derivative expresses, written from docs/model.md sections 9 and 12 alone, as `second_plant` is from the rest.

It imports nothing of the project. `second_plant` adds it to its coefficients.
"""

from __future__ import annotations

from typing import Any

import numpy as np

COMMON = ("airspeed", "time")
ACROSS = ("alpha_beta", "beta3", "airspeed2", "q", "alpha_p", "alpha_r", "CT", "beta_CT", "betadot")  # of Cl and Cn
TERMS: dict[str, tuple[str, ...]] = {
    "CX": (*COMMON, "elevator", "beta2", "rudder2"),
    "CY": (*COMMON, "alpha_beta", "beta3", "aileron", "alpha_p", "alpha_rudder", "beta_CT", "betadot"),
    "CZ": (*COMMON, "alpha2", "alpha3", "beta2", "alpha_q", "alpha_CT", "alphadot"),
    "Cl": (*COMMON, *ACROSS, "p3", "aileron3", "aileron_airspeed", "phi"),
    "Cm": (*COMMON, "alpha2", "alpha3", "alpha_elevator", "elevator2", "elevator3", "q3", "airspeed2", "beta2",
           "elevator_airspeed", "aileron", "p", "r", "alpha_q", "alpha_CT", "theta"),
    "Cn": (*COMMON, *ACROSS, "r3", "rudder3", "alpha", "alpha_aileron", "alpha_rudder", "rudder_airspeed", "alpha_CT"),
}
LOADS = {"elevator": "alpha", "aileron": "p", "rudder": "beta"}
BENDS = tuple(f"{s}_{bend}" for s in LOADS for bend in (
    "cube", "side", "magnitude", "direction", "of_airspeed", f"of_{LOADS[s]}", *(f"of_{o}" for o in LOADS if o != s)))
NAMES = (*(f"{coefficient}_{term}" for coefficient, terms in TERMS.items() for term in terms), *BENDS)


def discrepancy(x: Any, a: Any, ct: Any, side: Any, c: Any, p: Any) -> dict[str, Any]:
    """CX to Cn that the terms add; `side`: the side force before them, N; records as in `second_plant`."""
    C13, C23 = 2 * (x.e1 * x.e3 - x.e0 * x.e2), 2 * (x.e2 * x.e3 + x.e0 * x.e1)
    turning = p.span / (2 * a.Vf**2) * (side / c.mass + C23 * p.gravity_sea_level)
    of = {"alpha": a.alpha, "beta": a.beta, "p": a.phat, "q": a.qhat, "r": a.rhat, "elevator": x.elevator,
          "aileron": x.aileron, "rudder": x.rudder, "airspeed": a.V, "time": c.elapsed, "CT": ct, "phi": C23,
          "theta": -C13, "alphadot": p.chord * (a.alpha - x.alpha_downwash) / (2 * p.tail_arm),
          "betadot": turning + a.alpha * a.phat - a.rhat}  # fmt: skip

    def value(term: str) -> Any:
        if term[-1] in "23":
            return of[term[:-1]] ** int(term[-1])
        first, _, second = term.partition("_")
        return of[first] * (of[second] if second else 1.0)

    return {coefficient: sum(getattr(p, f"{coefficient}_{term}") * value(term) for term in terms)
            for coefficient, terms in TERMS.items()}


def bent(surface: str, asked: Any, x: Any, a: Any, p: Any) -> Any:
    """Where a surface is told to go that is asked to be at `asked` rad."""
    of = {"alpha": a.alpha, "beta": a.beta, "p": x.p, "airspeed": a.V, **{s: getattr(x, s) for s in LOADS}}
    k = {name.removeprefix(f"{surface}_"): getattr(p, name) for name in BENDS if name.startswith(f"{surface}_")}
    told = asked + k["cube"] * asked**3 + k["side"] * np.clip(asked / 0.02, -1, 1) + k["magnitude"] * np.abs(asked)
    told = told + sum(size * of[name[3:]] for name, size in k.items() if name.startswith("of_"))
    band = np.maximum(-k["direction"], 0)
    return told - np.clip(told - getattr(x, surface), -band, band)
