"""How fast identification is: `python -m testbed.benchmarks.identify_speed` prints medians.

Timed are every registered method and data compatibility on a longitudinal record of 20 s at 50 Hz, stepwise regression
of 1,000 such records in two processes, and a step of every method that can run in flight. Medians over repetitions,
since machines are noisy; but for the 1,000 records, one thread.
"""

from __future__ import annotations

import importlib
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from estimators.compatibility.record import check_compatibility
from estimators.methods import METHODS, method
from estimators.observer.measurements import airframe_of_record, measurements
from estimators.regression import equation_error
from estimators.signals.data_checks import check
from estimators.signals.fourier_smoothing import fourier_smooth
from estimators.signals.resample import common_grid
from icing_env import scenario as scenarios
from icing_env.record import FlightRecord
from icing_env.types import ESTIMATE
from testbed.flight import fly
from testbed.workers import processes

CHANNELS = ("time", "airspeed", "alpha", "q", "theta", "ax", "az", "elevator", "thrust_left", "thrust_right",
            "pressure", "temperature")  # fmt: skip
LATERAL = ("beta", "p", "r", "phi", "ay", "aileron", "rudder")
REPEATS, PATIENCE = 9, 4.0  # at most so often, and so many seconds
RECORDS, PROCESSES = 1000, 2
REAL_TIME = {
    "hinf": "estimators.hinf", "rls": "estimators.recursive.rls", "ekf": "estimators.recursive.ekf",
    "ukf": "estimators.recursive.ukf", "real_time_frequency": "estimators.recursive.real_time_frequency",
}  # fmt: skip


def flight(lateral: bool = False) -> FlightRecord:
    """20 s at 50 Hz around the elevator doublets of a simulated flight in light turbulence."""
    scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=29.0, initial={"airspeed": 72.0})
    record = fly(scenario, seed=1, observer=False, protection=False).record
    kept = {*CHANNELS, *(LATERAL if lateral else ())}
    record = record.take((record.time >= 8.0) & (record.time < 28.0))
    return replace(record, channels={name: v for name, v in record.channels.items() if name in kept})


def seconds(run: Callable[[], Any]) -> float:
    """Median time of a call, the first not counted."""
    run()
    taken: list[float] = []
    while len(taken) < REPEATS and sum(taken) < PATIENCE:
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken)


def chain(record: FlightRecord) -> None:
    """Smoothing, data compatibility, stepwise regression and orthogonal functions on one record."""
    for name in ("alpha", "q", "az"):
        fourier_smooth(record[name], record.dt)
    fixed = check_compatibility(record).record
    equation_error.identify(fixed)
    method("orthogonal")(fixed)


def methods(record: FlightRecord) -> dict[str, float]:
    """Seconds of each registered method on a record."""
    return {name: seconds(partial(method(name), record)) for name in METHODS}


def regress(records: int, first: int) -> int:
    """Stepwise regression of some records that differ in their noise; how many derivatives were found in the last."""
    record, found = flight(), 0
    for seed in range(first, first + records):
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(len(record))
        found = len(equation_error.identify(replace(record, channels={**record.channels, "q": record["q"] + noise})))
    return found


def many_records() -> float:
    """Seconds of stepwise regression over `RECORDS` records in two processes of one thread each, their start aside."""
    kept = {name: os.environ.get(name) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
    os.environ.update(dict.fromkeys(kept, "1"))  # two processes on two cores: more threads only wait for each other
    try:
        with processes(PROCESSES) as pool:
            list(pool.map(regress, [1] * PROCESSES, range(PROCESSES)))
            start = time.perf_counter()
            list(pool.map(regress, [RECORDS // PROCESSES] * PROCESSES, range(0, RECORDS, RECORDS // PROCESSES)))
            return time.perf_counter() - start
    finally:
        for name, value in kept.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def real_time(record: FlightRecord) -> dict[str, float]:
    """Seconds of flight per second of computing, for each method that can run in flight."""
    record = check(record)
    grid = common_grid(record)
    measurement, airframe = measurements(grid, record), airframe_of_record(record, None)
    rows, found = [measurement[k : k + 1] for k in range(len(grid.time))], {}
    for name, path in REAL_TIME.items():
        if name not in METHODS:
            continue
        module = importlib.import_module(path)
        tuning, estimate = module.default_tuning(), np.zeros(1, ESTIMATE)

        def run(module: Any = module, tuning: Any = tuning, estimate: Any = estimate) -> None:
            memory = module.init(airframe, tuning, 1)
            for row in rows:
                module.step(memory, estimate, row, airframe, tuning, grid.dt)

        found[name] = len(rows) * grid.dt / seconds(run)
    return found


def main() -> None:
    """Measure and print."""
    record = flight()
    print(f"longitudinal record, {len(record)} samples, one thread [ms]")
    timed = {"chain": seconds(partial(chain, record))}
    for kind, wind in (("still air", False), ("wind states", True)):
        timed[f"compatibility, {kind}"] = seconds(partial(check_compatibility, record, wind))
    for name, value in (timed | methods(record)).items():
        print(f"  {name:28s} {1e3 * value:10.1f}")
    print(f"stepwise regression of {RECORDS} records, {PROCESSES} processes [s]\n  {'':28s} {many_records():10.1f}")
    print("seconds of flight per second of computing, all axes")
    for name, value in real_time(flight(lateral=True)).items():
        print(f"  {name:28s} {value:10.0f}")


if __name__ == "__main__":
    main()
