"""All derivatives by output error, and the effect whose change of them is nearest to how they came out.

Output error is fitted to every record by itself (estimators.likelihood.output_error) and the records' estimates are
averaged. What stands out is counted in standard errors, the spread of published derivatives included. An effect is
expected to change derivatives as regression on its own lack finds it would (`coefficients`), and instruments' errors
that output error estimates beside them as its name says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimators.combine import combine
from estimators.estimate import Estimate
from estimators.likelihood.output_error import identify
from icing_env.record import FlightRecord, FloatArray
from icing_env.types import DERIVATIVE_NAMES
from sim2real.library.candidates import SPREAD
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.rivals.coefficients import Lack, Variant, lack, parameter_rows, variants
from testbed.rivals.opinion import Opinion, Scale, Size

SCALE = Scale(level=2.23, width=0.392, sharpness=0.902, doubt=0.0879)  # testbed.rivals.scales, 90 development cases
TERMS = {
    "CX": ("0", "alpha", "alpha2"), "CZ": ("0", "alpha", "q", "elevator"), "Cm": ("0", "alpha", "q", "elevator"),
    "CY": ("0", "beta", "p", "r", "rudder"), "Cl": ("0", "beta", "p", "r", "aileron", "rudder"),
    "Cn": ("0", "beta", "p", "r", "aileron", "rudder"),
}  # fmt: skip
# Errors of instruments that output error estimates too: the number of PARAMETERS, and what is believed of it.
INSTRUMENTS = {"alpha_scale": ("scale_alpha", 0.03), "beta_scale": ("scale_beta", 0.03),
               "alpha_lag": ("vane_lag", 0.01), "beta_lag": ("vane_lag", 0.01), "bias_q": ("bias_q", 2e-4),
               "bias_az": ("bias_az", 0.05)}  # fmt: skip
# What output error says of aircraft that are the model's own, beside the model's numbers (mean over eight calm
# development flights without a gap): a thrust line above the c.g., a downwash that lags, a low pass of the recording.
OWN = {"Cm_0": -0.0088, "Cm_alpha": 0.044, "Cm_q": -2.0, "Cm_elevator": -0.15, "alpha_lag": -0.009, "beta_lag": -0.009,
       "alpha_scale": -0.02}  # fmt: skip
GUSTED = ("alpha_scale", "CX_alpha", "CX_alpha2")  # what takes up gusts: a vane scaled by -0.5 on flights without a gap
WARNED = 4.0  # by which standard errors are multiplied that turbulence makes too narrow (flights at sigma_w 1.5 m/s)
LEAST = {"CX_0": 1e-3, "CZ_0": 5e-3, "Cm_0": 1e-3, "CY_0": 1e-3, "Cl_0": 1e-4, "Cn_0": 1e-4}  # assumed: of offsets


def consider(records: Sequence[FlightRecord]) -> Opinion:
    """What output error says of the records of one aircraft.

    Raises:
        InputError: a record that cannot be used.
    """
    flights, tried = [reconstruct(record) for record in records], variants()
    departure, scatter = departures(flights[0], combine([fitted(record) for record in records]))
    made = expected(flights, tried, list(departure)) / scatter
    seen = np.array(list(departure.values())) / scatter
    square = np.maximum(np.sum(made**2, axis=1), 1e-12)
    along = made @ seen
    evidence: dict[str, float] = {}
    sizes: dict[str, Size] = {}
    for variant, gain, share, each in zip(tried, 0.5 * along**2 / square, along / square, square, strict=True):
        p = variant.parameter
        if gain >= evidence.get(variant.effect, -1.0):
            evidence[variant.effect] = float(gain)
            middle, error = p.neutral + share * (variant.size - p.neutral), abs(variant.size) / math.sqrt(each)
            sizes[variant.effect] = Size(p, *(float(np.clip(middle + k * error, p.low, p.high))
                                              for k in (0.0, -1.96, 1.96)))
    return Opinion(max(float(np.max(np.abs(seen))), 1e-6), evidence, sizes)


def fitted(record: FlightRecord) -> dict[str, Estimate]:
    """Estimates of one record; where output error itself warns of turbulence wider, and without what takes it up."""
    return {name: replace(e, std_error=WARNED * e.std_error) if e.warning else e
            for name, e in identify(record).items() if not (e.warning and name in GUSTED)}  # fmt: skip


def departures(flight: Reconstruction, found: Mapping[str, Estimate]) -> tuple[dict[str, float], FloatArray]:
    """By how much each estimate differs from the model's number, and how much of that is error or spread [n]."""
    model, out, scatter = flight.parameters[0], {}, []
    for name, e in found.items():
        if name in INSTRUMENTS:
            number, spread = INSTRUMENTS[name]
            published = float(model[number])
        elif name in DERIVATIVE_NAMES or name in LEAST:
            published = float(model[name]) if name in (model.dtype.names or ()) else 0.0
            spread = max(SPREAD * abs(published), LEAST.get(name, 0.0))
        else:
            continue
        out[name] = e.estimate - published - OWN.get(name, 0.0)
        scatter.append(math.hypot(e.std_error, spread))
    return out, np.array(scatter)


def expected(flights: Sequence[Reconstruction], tried: Sequence[Variant], names: Sequence[str]) -> FloatArray:
    """How much of each estimate every variant should change [variants, names]."""
    found, rows = lack(flights, tried), parameter_rows(flights[0], tried)
    changes = regressed(found, flights)
    out = np.zeros((len(tried), len(names)))
    for j, name in enumerate(names):
        if name in changes:
            out[:, j] = changes[name]
    for i in range(len(tried)):
        told = {n: float(rows[number][1 + i] - rows[number][0]) for n, (number, _) in INSTRUMENTS.items()}
        if any(told.values()):
            out[i] = [told.get(name, 0.0) for name in names]
    return out


def regressed(found: Lack, flights: Sequence[Reconstruction]) -> dict[str, FloatArray]:
    """Derivatives that regression would find in the lack of every variant, by name [variants]."""
    p = flights[0].parameters[0]
    c, speed = found.channels, 2.0 * found.channels["airspeed"]
    series = {**c, "0": np.ones(len(speed)), "alpha2": c["alpha"] ** 2, "p": c["p"] * p["span"] / speed,
              "q": c["q"] * p["chord"] / speed, "r": c["r"] * p["span"] / speed}  # fmt: skip
    out = {}
    for coefficient, terms in TERMS.items():
        matrix = np.column_stack([series[term] for term in terms])
        theta = np.linalg.lstsq(matrix, found.signatures[coefficient].T, rcond=None)[0]
        out.update({f"{coefficient}_{term}": theta[k] for k, term in enumerate(terms)})
    return out
