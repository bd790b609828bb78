"""The kinematics as a model whose errors of instruments are fitted, with standard errors that hold.

The motion is driven by noisy gyros and accelerometers, whose integral the fit takes for motion. What that noise does to
the estimates is found by drawing it, and added to the covariance of the fit (else the error of a gyro's bias comes out
five times too small).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.compatibility.kinematics import PARAMETERS, simulate
from estimators.likelihood.newton import MaximumLikelihood, fit
from icing_env.record import FloatArray

# From the one that is kept longest to the one that goes first, with the largest that is plausible (assumed).
PLAUSIBLE = {
    "bias_q": 0.02, "bias_p": 0.02, "bias_r": 0.02, "bias_az": 1.0, "bias_ay": 1.0, "bias_ax": 1.0,  # rad/s, m/s2
    "scale_alpha": 0.5, "scale_beta": 0.5,
    "bias_theta": 0.02, "bias_phi": 0.02, "bias_alpha": 0.02, "bias_beta": 0.02,  # rad
}  # fmt: skip
ORDER = tuple(PLAUSIBLE)
DRAWS = 48  # of the noise of the inputs: errors then hold to a tenth

Filter = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Readings:
    """What the kinematics are driven by and compared with.

    Attributes:
        inputs: (N, 6) readings of `kinematics.INPUTS`.
        measured: (N, k) readings of the outputs `channels`; nan where not sampled.
        channels: their places among `kinematics.OUTPUTS`.
        dt: s.
        start: (k,) about what they read at first.
        noise: (6,) standard deviation of the white noise of the inputs.
    """

    inputs: FloatArray
    measured: FloatArray
    channels: tuple[int, ...]
    dt: float
    start: FloatArray
    noise: FloatArray


class Model:
    """The kinematics as a model of any subset of the parameters, its outputs through a linear filter."""

    def __init__(self, readings: Readings, difference: Filter) -> None:
        self.readings, self.difference = readings, difference
        self.measured = self.through(readings.measured[None])[0]

    def through(self, outputs: FloatArray) -> FloatArray:
        """Outputs (m, N, k) filtered about the first reading: from rest, the filter would see a step."""
        return self.difference(outputs - self.readings.start)

    def fit(self, names: tuple[str, ...], row: FloatArray, most: int = 30) -> MaximumLikelihood:
        """Maximum likelihood of the named parameters from `row` (21,)."""
        places = [PARAMETERS.index(name) for name in names]

        def outputs(thetas: FloatArray) -> FloatArray:
            rows = np.repeat(row[None], len(thetas), axis=0)
            rows[:, places] = thetas
            return self.through(simulate(rows, self.readings.inputs, self.readings.dt)[:, :, self.readings.channels])

        # A parabola through points a thousandth of a plausible error apart is straight enough, and clear of rounding.
        step = np.array([1e-3 * PLAUSIBLE.get(name, 0.05) for name in names])
        # The last bits of a recorded angle: perfect data has no residual, and its correlations no meaning below it.
        floor = np.where(np.array(self.readings.channels) == 0, 1e-5, 1e-7)
        return fit(outputs, row[places], self.measured, step=step, floor=floor, most=most)

    def covariance(self, result: MaximumLikelihood, row: FloatArray) -> FloatArray:
        """Covariance (p, p) of a fit that ended at `row` (21,), with what the noise of the inputs adds."""
        readings, generator = self.readings, np.random.default_rng(0)
        calm = simulate(row[None], readings.inputs, readings.dt)
        moved = np.empty((DRAWS, len(result.theta)))
        for i in range(DRAWS):
            noise = readings.noise * generator.standard_normal(readings.inputs.shape)
            change = (simulate(row[None], readings.inputs + noise, readings.dt) - calm)[:, :, readings.channels]
            weighted = self.difference(change)[0] / result.noise
            moved[i] = result.covariance_white @ np.einsum("nkp,nk->p", result.sensitivity, weighted)
        return np.asarray(result.covariance + moved.T @ moved / DRAWS, dtype=np.float64)

    def residual(self, row: FloatArray) -> FloatArray:
        """Unfiltered readings less the model's (N, k)."""
        rows = simulate(row[None], self.readings.inputs, self.readings.dt)[0]
        return np.asarray(self.readings.measured - rows[:, self.readings.channels], dtype=np.float64)
