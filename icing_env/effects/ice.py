"""What the effects of ice share: the floor of a factor and the saturation of the stall shift."""

import numpy as np
from numpy.typing import NDArray


def scale(p: NDArray, name: str, factor: NDArray) -> None:
    """Multiply a coefficient by an ice factor, floored as in `severity.iced_aircraft`."""
    p[name] *= np.maximum(factor, p["ice_factor_floor"])


def saturated(eta: float | NDArray) -> NDArray:
    """Saturation e(eta) of the SIS nonlinear model (FlightGear uiuc_iced_nonlin.cpp)."""
    return np.where(np.asarray(eta) <= 0.1, eta, 0.3 - 0.3297*np.exp(-5.0*np.asarray(eta)))
