"""Data compatibility of a whole record: biases and scale factors of its instruments, and the record without them.

`wind=False` is the usual analysis: output error on the kinematics, in still air. What turbulence adds to the vanes then
lands in the scale factors and biases (the founding paper's figure 20), and its standard errors do not hold; the record
says so. `wind=True` carries Dryden gusts as states (estimators.compatibility.gusts).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimators.compatibility.flow_angles import at_centre_of_gravity
from estimators.compatibility.gusts import Whitening, measure
from estimators.compatibility.kinematics import OUTPUTS, SCALED
from estimators.compatibility.model import ORDER, PLAUSIBLE, Filter, Model, Readings
from estimators.compatibility.readings import NEEDED, candidates_of, readings_of, without_blanks
from estimators.compatibility.selection import Found, select
from estimators.estimate import Estimate
from estimators.signals.data_checks import check
from estimators.signals.gust_level import LENGTH
from estimators.signals.instruments import calibrated
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord, FloatArray

UNITS = {"airspeed": "m/s", "ax": "m/s2", "ay": "m/s2", "az": "m/s2", "p": "rad/s", "q": "rad/s", "r": "rad/s"}
SMOOTH = 0.3  # m/s: sigma of the gusts up to which flight tests call the air smooth (assumed)
KINDS = ("none", "kinematic", "wind")
PASSES = 2  # of measuring the gusts and fitting again


@dataclass(frozen=True)
class Compatibility:
    """Errors of the instruments that make the record one motion.

    Attributes:
        parameters: bias_NAME (the channel's unit) and scale_NAME (1), with `reading = (1 + scale) truth + bias`;
            `identifiable` is false for what was left out, which counts as zero, and for what came out larger than an
            instrument can be wrong by, which is told but not taken out of the record.
        record: corrected for what was found, flow angles and accelerations at the centre of gravity.
        time: s (N,).
        residual: readings less the motion's, by channel (N,).
        gust: smoothed gusts by channel, as velocity of the air "u", "v", "w" (N,) m/s, where `wind` was asked for.
        sigma: standard deviation of the gust in each of them, m/s, measured in either case.
        converged: whether the fit did.
        notes: what was assumed and what to beware of.
    """

    parameters: dict[str, Estimate]
    record: FlightRecord
    time: FloatArray
    residual: dict[str, FloatArray]
    gust: dict[str, FloatArray]
    sigma: dict[str, float]
    converged: bool
    notes: tuple[str, ...]

    @property
    def found(self) -> dict[str, Estimate]:
        """Those errors that the record shows."""
        return {name: e for name, e in self.parameters.items() if e.identifiable}


def check_compatibility(record: FlightRecord, wind: bool = False, largest_scale: float = 0.5) -> Compatibility:
    """Find the errors of the instruments in `record`, without or with gusts as states.

    Args:
        record: some tens of seconds; over minutes what the gyros' noise adds to the motion outgrows everything else.
        wind: carry Dryden gusts as states.
        largest_scale: largest scale factor that is believed and taken out of the record (assumed: a vane that reads
            half or one and a half times the angle). A larger one reproduces analyses that took what they found.

    Raises:
        InputError: the record is refused by `data_checks.check`, lacks time, airspeed, alpha, q, theta, ax or az, or
            its motion cannot be followed.
    """
    record = calibrated(check(record))
    grid = common_grid(record)
    lacking = [name for name in NEEDED if name not in grid.values]
    if lacking:
        raise InputError(f"record '{record.meta.name}' lacks {', '.join(lacking)}: compatibility needs "
                         f"{', '.join(NEEDED)}")  # fmt: skip
    values, notes = at_centre_of_gravity(grid.values, record.meta.sensors, grid.dt)
    readings, channels = readings_of(grid, values, record)
    candidates, ruled = candidates_of(grid, values, channels)
    model = Model(readings, lambda y: y)
    found = select(model, candidates, ruled)
    gusts = _gusts(readings, model.residual(found.row))
    if wind:
        for _ in range(PASSES):
            model = Model(replace(readings, measured=without_blanks(readings, values)), _filter(gusts))
            found = select(model, candidates, ruled, found.row)
            gusts = _gusts(readings, model.residual(found.row))
    return _answer(record, grid, values, readings, found, gusts, wind, largest_scale, notes)


def corrected(record: FlightRecord, wind: bool = False) -> FlightRecord:
    """The record without the errors that `check_compatibility` finds in it; errors as there."""
    return check_compatibility(record, wind).record


def made_compatible(record: FlightRecord, kind: str) -> FlightRecord:
    """The record as an analysis is to see it: as it is ("none"), or corrected, without or with wind states.

    Raises:
        InputError: `kind` is none of `KINDS`; or as `check_compatibility`.
    """
    if kind not in KINDS:
        raise InputError(f"compatibility '{kind}' is unknown; valid are: {', '.join(KINDS)}")
    return record if kind == "none" else corrected(record, kind == "wind")


def _gusts(readings: Readings, residual: FloatArray) -> dict[int, tuple[Whitening, float]]:
    """Whitening filter and noise for each flow channel, by its place among the columns."""
    found = {}
    for column, channel in enumerate(readings.channels):
        if OUTPUTS[channel] in SCALED:
            step = readings.start[0] * readings.dt / LENGTH
            known = np.isfinite(residual[:, column])
            centred = residual[known, column]
            found[column] = measure(centred, OUTPUTS[channel] != "airspeed", step)
    return found


def _filter(gusts: dict[int, tuple[Whitening, float]]) -> Filter:
    """The whitening of every flow channel."""

    def through(outputs: FloatArray) -> FloatArray:
        out = outputs.copy()
        for column, (filtered, _) in gusts.items():
            out[:, :, column] = filtered(outputs[:, :, column], axis=1)
        return out

    return through


def _answer(
    record: FlightRecord,
    grid: Grid,
    values: Mapping[str, FloatArray],
    readings: Readings,
    found: Found,
    gusts: dict[int, tuple[Whitening, float]],
    wind: bool,
    largest_scale: float,
    notes: tuple[str, ...],
) -> Compatibility:
    """Everything that is told."""
    residual = Model(readings, lambda y: y).residual(found.row)
    air, sigma = {}, {}
    for column, (filtered, noise) in gusts.items():
        name = OUTPUTS[readings.channels[column]]
        per = -1.0 if name == "airspeed" else -float(np.mean(values["airspeed"]))
        axis = {"airspeed": "u", "alpha": "w", "beta": "v"}[name]
        sigma[axis] = abs(per) * noise * filtered.ratio
        if wind:
            air[axis] = per * filtered.gust(np.nan_to_num(residual[:, column]))
    told = [name for name in ORDER if name in found.names or name in found.dropped]
    parameters = {name: _estimate(name, found, wind, largest_scale) for name in told}
    if not wind and max(sigma.get(axis, 0.0) for axis in ("v", "w")) > SMOOTH:
        notes += (f"turbulence of sigma {max(sigma.values()):.1f} m/s lands in scale factors and biases: standard "
                  "errors do not hold; with wind states they do",)  # fmt: skip
    names = [OUTPUTS[i] for i in readings.channels]
    return Compatibility(
        parameters, _corrected(record, grid, values, parameters), grid.time,
        {name: residual[:, j] for j, name in enumerate(names)}, air, sigma, found.result.converged, notes,
    )  # fmt: skip


def _estimate(name: str, found: Found, wind: bool, largest_scale: float) -> Estimate:
    method = "compatibility with wind states" if wind else "compatibility"
    unit = "1" if name.startswith("scale_") else UNITS.get(name.removeprefix("bias_"), "rad")
    if name in found.names:
        value, error = found.value(name)
        why = ""
        if abs(value) > (largest_scale if unit == "1" else PLAUSIBLE[name]):
            why = f"{value:.2g} is more than an instrument can be wrong by: gusts, or another fault, stand in it"
        return Estimate(value, error, unit, method, None, not why, why)
    return Estimate(0.0, float("nan"), unit, method, None, False, found.dropped[name])


def _corrected(
    record: FlightRecord, grid: Grid, values: Mapping[str, FloatArray], parameters: dict[str, Estimate]
) -> FlightRecord:
    """The record on its grid without the errors found; what its owner computed belongs to it as it was."""
    channels, problems = {"time": grid.time}, []
    for name in record.channels:
        if name not in values:
            continue
        wrong = [parameters.get(f"{kind}_{name}") for kind in ("bias", "scale")]
        offset, share = (e.estimate if e is not None and e.identifiable else 0.0 for e in wrong)
        fixed = (values[name] - offset) / (1.0 + share)
        channels[name] = np.where(grid.missing[name], np.nan, fixed) if name in grid.missing else fixed
        if offset or share:
            told = [f"bias {offset:.3g}"] * bool(offset) + [f"scale {share:+.3f}"] * bool(share)
            problems.append(
                DataProblem(name, f"{', '.join(told)} taken out", float(grid.time[0]), float(grid.time[-1]), True)
            )
    owner = {name: grid.values[name] for name in record.owner if name in grid.values}
    places = {n: {**e, "corrected": True} if isinstance(e, Mapping) else e for n, e in record.meta.sensors.items()}
    meta = replace(record.meta, corrected=True, sensors=places)
    return replace(record, channels=channels, owner=owner, meta=meta).with_problems(problems)
