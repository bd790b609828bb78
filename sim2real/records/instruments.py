"""What a record's instruments do to what they read: as its side file declares, else as the aircraft file has them.

The table `sensors` may declare, beside what identification reads (`estimators.signals.instruments`), the low pass of
the recorder: `filter = { lag = 0.008 }` in s by which a slow change shows late, or `{ frequency = 10.0, order = 2 }` of
a Butterworth filter in Hz (0: none; first order if not told). It acts on flow angles, rates, accelerations and
surfaces, and not on attitudes. Those therefore tell of it, since an attitude is the integral of rates whatever flies
(Klein & Morelli, Aircraft System Identification, AIAA 2006, chapter 10): what is integrated from rates that are late by
L lacks L times the rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.compatibility.flow_angles import at_centre_of_gravity
from estimators.signals.data_checks import repaired
from estimators.signals.instruments import attitude_rates, calibration, rate, time_constant, with_prompt_attitudes
from estimators.signals.resample import common_grid
from icing_env import aircraft
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray
from sim2real.records.channels import SURFACES
from sim2real.records.low_pass import in_first_order

STEP = 0.02  # s, at which the aircraft file's instruments take in what they read (icing_env.simulate)
UNFILTERED = 1e6  # Hz: no low pass
LONGEST = 0.05  # s: a recorder's low pass is not slower, nor do attitudes lag more (assumed)
KNOWN, APART = 0.002, 0.003  # s: how well attitudes have to tell a low pass, and how far it has to be from the file's
SPAN, FEWEST = 5.0, 6  # s over which attitudes and integrated rates are compared (gyros drift beyond), and how often
RATES = ("p", "q", "r", "phi", "theta")
PASSED = ("alpha", "beta", *RATES[:3], "ax", "ay", "az", *SURFACES)  # the recorder's low pass
FLOOR = 2e-4  # s: no lag of a recorder is known better (assumed)
MISSING = 0.02  # share of samples that a channel may lack there


def lateness(lag: float, dt: float) -> float:
    """Time by which a first-order lag updated every `dt` with its newest value shows a slow change late, s."""
    return dt / math.expm1(dt / lag) if lag > 0.0 else 0.0


def with_recorder(records: Sequence[FlightRecord]) -> list[FlightRecord]:
    """Records that declare no low pass declare the one that their attitudes tell of, where it is not the file's.

    Attitudes that are declared to be late are so no more.
    """
    records = [with_prompt_attitudes(record) for record in records]
    told = recorder_lags([record for record in records if "filter" not in record.meta.sensors])
    if told is None:
        return list(records)
    value, error = np.array(told).T  # [axes]
    weight = error**-2.0 / np.sum(error**-2.0)
    lag, file = float(value @ weight), _published_lag()
    contradiction = abs(value[0] - value[1]) / float(np.hypot(*error))  # of one and the same recorder
    sharp = max(1.0, contradiction) * float(np.sum(error**-2.0) ** -0.5)
    if sharp > KNOWN or abs(lag) > LONGEST or abs(lag - file) < max(APART, 3.0 * sharp):
        return list(records)
    found = {"filter": {"lag": max(lag, 0.0), "found": True}}
    return [replace(r, meta=replace(r.meta, sensors={**found, **r.meta.sensors})) for r in records]


def _published_lag() -> float:
    cut = float(aircraft.load()["filter_frequency"][0])
    return lateness(1.0 / (2.0 * math.pi * cut), STEP)


def recorder_lags(records: Sequence[FlightRecord]) -> list[tuple[float, float]] | None:
    """By how much rates show later than attitudes, and its standard error [s], in pitch and in roll; None if unknown.

    Beside the lag, integrated rates may differ by their scale and by a part of the other angle (gyros that are not
    square). Errors are those of spans of all records that count as one each (Liang & Zeger's sandwich, Biometrika 73,
    1986): of one record's few spans they come out far too small by luck.
    """
    spans = [found for record in records if (found := _of_attitudes(repaired(record))) is not None]
    return [_lead([own[axis] for own in spans]) for axis in (0, 1)] if spans else None


def _of_attitudes(record: FlightRecord) -> tuple[FloatArray, FloatArray] | None:
    """Rate, angle, other angle and what is missing of the angle's integral in spans [spans, samples, 4], both axes."""
    if any(n not in record.channels for n in RATES) or len(record) < 20 * FEWEST:
        return None
    missing = {n: float(np.mean(~np.isfinite(record[n]))) for n in RATES}
    at = np.arange(len(record)) if max(missing.values()) <= MISSING else _slow_attitudes(record, missing)
    if len(at) < 20 * FEWEST:
        return None
    grid = common_grid(record)
    made, phi, theta = attitude_rates(grid.values), grid.values["phi"], grid.values["theta"]
    return _in_spans(theta, made["theta"], phi, grid.dt, at), _in_spans(phi, made["phi"], theta, grid.dt, at)


def _slow_attitudes(record: FlightRecord, missing: dict[str, float]) -> NDArray[np.intp]:
    """Rows at which both attitudes were sampled, if at every so manieth row beside rates at all; else none."""
    rows = np.flatnonzero(np.isfinite(record["phi"]) & np.isfinite(record["theta"]))
    step = np.diff(rows)
    even = len(step) > 0 and step.max() == step.min() and np.ptp(np.diff(record.time)) < 0.01 * record.dt
    return rows if even and max(missing[n] for n in RATES[:3]) <= MISSING else rows[:0]


def _in_spans(angle: FloatArray, turns: FloatArray, other: FloatArray, dt: float, at: NDArray[np.intp]) -> FloatArray:
    """Columns of `_of_attitudes` less a line in every span; `at`: rows at which the angles were sampled."""
    made = np.concatenate([[0.0], np.cumsum(0.5 * (turns[1:] + turns[:-1]) * dt)])
    columns = np.column_stack([turns, angle, other, angle - made])[at[at < len(made)]]
    length = min(round(SPAN / (dt * float(np.median(np.diff(at))))), len(columns) // FEWEST)
    spans = columns[: len(columns) // length * length].reshape(-1, length, 4)
    line = np.linalg.qr(np.column_stack([np.ones(length), np.linspace(-1.0, 1.0, length)]))[0]
    return np.asarray(spans - line @ (line.T @ spans))


def _lead(records: Sequence[FloatArray]) -> tuple[float, float]:
    """Lag of a rate behind the angle that it makes in the spans of some records, and its standard error, s."""
    bread = np.linalg.pinv(sum(np.einsum("sni,snj->ij", own[:, :, :3], own[:, :, :3]) for own in records))
    x = bread @ sum(np.einsum("sni,sn->i", own[:, :, :3], own[:, :, 3]) for own in records)
    each = np.concatenate([np.einsum("sni,sn->si", own[:, :, :3], own[:, :, 3] - own[:, :, :3] @ x)
                           for own in records]) @ bread
    count = len(each)
    return float(x[0]), float(np.sqrt(np.sum(each[:, 0] ** 2) * count / (count - 3)) + FLOOR)


def declared(row: NDArray, record: FlightRecord, values: dict[str, FloatArray], dt: float, notes: list[str]) -> None:
    """Give the model's `row` the instruments of a record, and bring `values` to the centre of gravity.

    Raises:
        InputError: a declaration that is none.
    """
    sensors, known = record.meta.sensors, calibration(record.meta.sensors)
    corrected, told = at_centre_of_gravity(values, sensors, dt)
    values |= corrected
    notes.extend(told)
    for name, lag in (("airspeed", "pitot_lag"), ("alpha", "vane_lag")):
        stated = name in known.lags or "lag" in table_of(sensors, name)
        late = known.lag(name) if stated else lateness(float(row[lag][0]), STEP)
        if stated or abs(dt - STEP) > 1e-6:
            row[lag] = time_constant(late, dt)
        notes.extend([f"{name} late by {1e3 * late:.3g} ms, as declared"] if stated else [])
    if "beta" in values and "lag" in table_of(sensors, "beta"):
        vane = lateness(float(row["vane_lag"][0]), dt)
        extra = known.lag("beta") - vane  # the model's vanes are alike
        values["beta"] = values["beta"] + (extra * rate(values["beta"], dt, abs(extra)) if extra else 0.0)
    if "bending" in table_of(sensors, "alpha"):
        row["boom_gain"] = known.bending
    if table_of(sensors, "thrust").get("found"):
        notes.append("thrust taken as measured: it is another function of torque and airspeed than in the references")
    _recorder(row, sensors, values, dt, notes)


def thrust_was_measured(record: FlightRecord) -> bool:
    """Whether the record declares so: `thrust = { source = "measured" }`; else it is taken as computed from torque.

    Raises:
        InputError: another source.
    """
    source = table_of(record.meta.sensors, "thrust").get("source", "computed")
    if source not in ("measured", "computed"):
        raise InputError(f"sensors.thrust.source must be measured or computed, got {source!r}")
    return bool(source == "measured")


def _recorder(row: NDArray, sensors: Any, values: dict[str, FloatArray], dt: float, notes: list[str]) -> None:
    table = table_of(sensors, "filter")
    for key in ("lag", "frequency", "order"):
        value = table.get(key, 0.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise InputError(f"sensors.filter.{key} must be a number, 0 for no low pass, got {value!r}")
    cut, order = float(table.get("frequency", 0.0)), max(math.ceil(table.get("order", 1)), 1)
    if "lag" in table:
        late, order = float(table["lag"]), 1
    elif "frequency" in table:
        slope = 1.0 / math.sin(0.5 * math.pi / order)  # of its phase at low frequencies
        late = slope / (2.0 * math.pi * cut) if cut else 0.0
    elif abs(dt - STEP) > 1e-6:
        late = _published_lag()
    else:
        return
    row["filter_frequency"] = 1.0 / (2.0 * math.pi * time_constant(late, dt)) if late > 0.0 else UNFILTERED
    higher = order > 1 and cut > 0.0
    if table:
        how = "attitudes tell" if table.get("found") else "declared"
        brought = ", brought to one of first order" if higher else ""
        notes.append(f"low pass of the recorder late by {1e3 * late:.3g} ms, as {how}{brought}")
    if higher:
        first = float(row["filter_frequency"][0])
        values |= {n: in_first_order(values[n], cut, order, first, dt) for n in PASSED if n in values}


def table_of(sensors: Any, name: str) -> Any:
    """What a side file's `sensors` tells of one instrument, by word; empty where that is no table."""
    entry = sensors.get(name, {})
    return entry if isinstance(entry, dict) else {}
