"""Who knows the true ice: the upper bound of every estimator and controller. Only the testbed may ask it.

What it says has the form of an observer's estimate and of the ice management's advisory, so that the same controllers
fly on it: the quasi-steady derivatives that a perfect identifier would find, with next to no standard error, and the
true severities and failures.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.sense import tell
from icing_env.atmosphere import GAS_CONSTANT
from icing_env.errors import InputError
from icing_env.simulate import Fleet
from icing_env.types import DERIVATIVE_NAMES, ESTIMATED_NAMES, SENSED_PARTS

FloatArray = NDArray[np.float64]
PERIOD = 0.5  # s between looks: ice changes in minutes, an inflation is seen half a second late
KNOWS = 2.0  # in `told`: severity and confidence are told as well
DOUBT = 1e-3  # standard error told, relative to the clean value: next to none
FAILED = ("boot_failed_left_wing", "boot_failed_right_wing", "boot_failed_htail", "prop_heat_failed")  # of SENSED_PARTS


def zero_lift_drag(c: Any) -> Any:
    """Drag coefficient at zero lift of the body-axis set (arrays or numbers by name)."""
    alpha = c["CZ_0"]/(c["CX_0"] - c["CZ_alpha"])
    return -(c["CX_0"] + alpha*(c["CX_alpha"] + alpha*c["CX_alpha2"]))/np.cos(alpha)


def quasi_steady(truth: Any, p: Any) -> dict[str, Any]:
    """What a regression without a downwash lag should find: the quasi-steady equivalent derivatives.

    The lag adds Cm_alphadot (c/2V) alpha_dot with alpha_dot = q + (rho S V/2m)(CZ_alpha alpha + CZ_q qhat + ...), so
    that each moment derivative gains Cm_alphadot (rho S c/4m) times its lift derivative; the lag's next term goes with
    alpha_ddot, nearly q_dot, and divides them by 1 + M_alphadot l_t/V = 1 + Cm_alphadot rho S c^2 l_t/(4 Iyy).
    CL_alpha at alpha = 0 is CX_0 - CZ_alpha. CD_0 is the drag at zero lift. (Etkin & Reid, Dynamics of Flight, 3rd ed.,
    section 5.5.)
    """
    lag = p["Cm_alphadot"]*truth["density"]*p["wing_area"]*p["chord"]/(4.0*truth["mass"])
    inertia = 1.0 + p["Cm_alphadot"]*truth["density"]*p["wing_area"]*p["chord"]**2*p["tail_arm"]/(4.0*p["inertia_yy"])
    drag = zero_lift_drag(truth) + truth["CD_parasite"]
    return {
        "quasi_CL_alpha": truth["CX_0"] - truth["CZ_alpha"],
        "quasi_CL_elevator": -truth["CZ_elevator"],
        "quasi_CD_0": drag,
        "quasi_Cm_alpha": (truth["Cm_alpha"] + lag*truth["CZ_alpha"])/inertia,
        "quasi_Cm_q": (truth["Cm_q"] + lag*truth["CZ_q"])/inertia,
        "quasi_Cm_elevator": (truth["Cm_elevator"] + lag*truth["CZ_elevator"])/inertia,
    }


class Oracle:
    """Estimates and severities of a fleet from its true state.

    Args:
        clean: PARAMETERS row of the clean aircraft.
        dt: step [s].
        estimate, advisory: ESTIMATE and ADVISORY rows that it writes.
        tuning: IMS_TUNING row.
    """

    def __init__(self, clean: NDArray, dt: float, estimate: NDArray, advisory: NDArray, tuning: NDArray) -> None:
        self.every, self.count = round(PERIOD/dt), np.zeros(1, np.int64)
        self.estimate, self.advisory, self.tuning, self.clean = estimate, advisory, tuning, clean
        self.fleet: Fleet | None = None
        fresh = estimate[:1]
        self.doubt = {f"{name}_std": DOUBT*max(abs(float(fresh[name][0])), 0.01) for name in ESTIMATED_NAMES}

    def reveal(self, fleet: Fleet) -> None:
        """Show it the truth: the fleet whose aircraft it speaks of."""
        self.fleet = fleet

    def reset(self, rows: NDArray) -> None:
        """Look at once."""
        self._look(rows)

    def observe(self) -> None:
        """Look when it is time."""
        if self.count[0] % self.every == 0:
            self._look(slice(None))
        self.count += 1

    def memory(self) -> dict[str, NDArray]:
        """What must be kept to go on later."""
        return {"oracle": self.count}

    def _look(self, rows: NDArray | slice) -> None:
        if self.fleet is None:
            raise InputError("the oracle was shown no fleet: call `reveal(world.fleet)` before the first reset")
        f = self.fleet
        now, state = f.current[rows], f.state[rows]
        p = f.parameters if len(f.parameters) == 1 else f.parameters[rows]
        said = self.estimate[rows]
        m = f.measurement[rows]
        for name, value in derivatives(now, m["pressure"]/(GAS_CONSTANT*m["temperature"]), p).items():
            said[name] = value
        for name, doubt in self.doubt.items():
            said[name] = doubt
        said["excess_drag"] = said["CD_0"] - zero_lift_drag(self.clean[0]) - self.clean["CD_parasite"][0]
        said["excitation_longitudinal"] = said["excitation_lateral"] = said["health"] = 1.0
        eta = np.stack([state[f"eta_{part}"] for part in SENSED_PARTS], axis=1)
        failed = np.stack([np.broadcast_to(p[name], len(state)) for name in FAILED], axis=1)
        told = self.advisory[rows]
        g = self.tuning[0]
        worst = np.maximum(eta.max(axis=1)/g["eta_severe"], said["excess_drag"]/g["drag_severe"])
        tell(told, eta, np.zeros(len(state)), worst > g["detect_severity"], failed > 0.5)
        told["severity"] = np.clip(said["excess_drag"]/g["drag_severe"], 0.0, 1.0)
        told["confidence"], told["told"] = 1.0, KNOWS
        self.estimate[rows], self.advisory[rows] = said, told


def derivatives(now: NDArray, air: FloatArray, p: NDArray) -> dict[str, FloatArray]:
    """Fields of ESTIMATE by name from CURRENT rows, density [n] and PARAMETERS rows (one or n)."""
    names = {*DERIVATIVE_NAMES, "CD_parasite", "mass"}
    quasi = quasi_steady({name: now[name] for name in names} | {"density": air}, p)
    said = {name: now[name] for name in ESTIMATED_NAMES if name in names} | {
        name.removeprefix("quasi_"): value for name, value in quasi.items()}
    rigged = {name: np.broadcast_to(p[name], len(now)) for name in ("CY_0", "Cl_0", "Cn_0")}
    return said | rigged | {"CL_0": -now["CZ_0"]}
