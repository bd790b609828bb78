"""Do the 95 % intervals of every method hold the truth? Doublet sets in calm air and in turbulence, many of each.

    python -m testbed.benchmarks.coverage --methods output_error,filter_error --sigma 0,0.5,1,1.5 --records 200

Truth is the quasi-steady equivalent of `testbed.flight.quasi_steady`. A table per method and intensity: by derivative
the share of intervals that hold the truth, the mean error and the mean half width in per cent of the truth, how often
the record was said to show it, and how often the method warned. Refused estimates do not count.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from estimators.estimate import Estimate
from estimators.methods import METHODS, method
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from testbed.flight import fly
from testbed.reproduce.windows import part
from testbed.workers import processes

NAMES = ("CL_alpha", "CL_elevator", "CD_0", "Cm_alpha", "Cm_q", "Cm_elevator", "CY_beta", "CY_r", "CY_rudder",
         "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder", "Cn_beta", "Cn_p", "Cn_r", "Cn_rudder")  # fmt: skip
# First seeds of two streams that share no flight: methods were worked on with the first, figures are of the other.
DEVELOPMENT, REPORT = 2_000, 900_000
TWO_SIDED = 1.96  # standard normal, 95 %
START, AIRSPEED, SCALE = 10.0, 72.0, 0.78  # s, m/s and doublet size: those of the handed flight records
WINDOW = (8.0, 50.0)  # s


@dataclass(frozen=True)
class Row:
    """One derivative by one method in one intensity of turbulence; shares 0..1, error and width in % of the truth."""

    method: str
    sigma_w: float
    name: str
    records: int
    shown: float
    coverage: float
    bias: float
    width: float
    warned: float


def doublet_record(sigma_w: float, seed: int) -> tuple[FlightRecord, dict[str, float]]:
    """A doublet set flown in turbulence of that intensity [m/s], and its true derivatives by name."""
    scenario = scenarios.load(
        "clear_air", aircraft="twin_otter_flight", duration=WINDOW[1], doublet_scale=SCALE,
        parameters={"turbulence_sigma_w": sigma_w}, initial={"airspeed": AIRSPEED}, ice_protection="off",
        events=({"time": START, "name": "doublets", "doublets": True},))  # fmt: skip
    flight = fly(scenario, seed=seed, protection=False, observer=False)
    time = flight.truth["time"]
    rows = (time >= WINDOW[0]) & (time <= WINDOW[1])
    mean = {name: float(np.mean(values[rows])) for name, values in flight.truth.items()}
    return part(flight.record, rows), {name: mean.get(f"quasi_{name}", mean.get(name, np.nan)) for name in NAMES}


def study(methods: Sequence[str], sigmas: Sequence[float], records: int, first: int = REPORT,
          workers: int = 2) -> list[Row]:
    """Rows of every method, intensity and derivative.

    Args:
        methods: names in `estimators.methods.METHODS`.
        sigmas: intensities of turbulence, m/s.
        records: flights per intensity.
        first: seed of the first of them.
        workers: processes.
    """
    found = []
    with processes(workers, None) as pool:
        for sigma_w in sigmas:
            tell = partial(_identified, tuple(methods), sigma_w)
            flights = list(pool.map(tell, range(first, first + records), chunksize=5))
            for name in methods:
                found += _rows(name, sigma_w, [(truth, results[name]) for truth, results in flights])
    return found


def _identified(methods: tuple[str, ...], sigma_w: float, seed: int
                ) -> tuple[dict[str, float], dict[str, dict[str, Estimate]]]:  # fmt: skip
    """Truth, and what each method says of one flight; a method that refuses the record says nothing."""
    record, truth = doublet_record(sigma_w, seed)
    results: dict[str, dict[str, Estimate]] = {}
    for name in methods:
        try:
            results[name] = method(name)(record)
        except InputError:
            results[name] = {}  # counted as not shown
    return truth, results


def _rows(name: str, sigma_w: float, flights: list[tuple[dict[str, float], dict[str, Estimate]]]) -> list[Row]:
    rows = []
    for key in NAMES:
        told = [(truth[key], found[key]) for truth, found in flights if key in found and found[key].identifiable]
        if not told:
            continue
        truth = np.array([t for t, _ in told])
        estimate, error = (np.array([getattr(e, k) for _, e in told]) for k in ("estimate", "std_error"))
        rows.append(Row(
            name, sigma_w, key, len(flights), len(told)/len(flights),
            float(np.mean(np.abs(estimate - truth) <= TWO_SIDED*error)),
            float(100.0*np.mean((estimate - truth)/np.abs(truth))),
            float(100.0*np.mean(TWO_SIDED*error/np.abs(truth))),
            sum(bool(e.warning) for _, e in told)/len(told)))  # fmt: skip
    return rows


def table(rows: Sequence[Row]) -> str:
    """The rows as text, a line each."""
    head = ("covers", 8), ("error %", 9), ("+- %", 8), ("shown", 7), ("warned", 8)
    lines = [f"{'method':20}{'sigma_w':>8} {'derivative':14}" + "".join(f"{text:>{wide}}" for text, wide in head)]
    lines += [f"{r.method:20}{r.sigma_w:8.2g} {r.name:14}{r.coverage:8.3f}{r.bias:9.2f}{r.width:8.2f}{r.shown:7.2f}"
              f"{r.warned:8.2f}" for r in rows]  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m testbed.benchmarks.coverage", description=__doc__.split("\n")[0])
    parser.add_argument("--methods", default=",".join(METHODS), help="comma-separated; all by default")
    parser.add_argument("--sigma", default="0,0.5,1,1.5", help="intensities of turbulence, m/s")
    parser.add_argument("--records", type=int, default=200, help="flights per intensity")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--development", action="store_true", help="the flights that methods were worked on with")
    parser.add_argument("--json", action="store_true", help="rows as JSON")
    options = parser.parse_args()
    sigmas = [float(text) for text in options.sigma.split(",")]
    first = DEVELOPMENT if options.development else REPORT
    rows = study(options.methods.split(","), sigmas, options.records, first, options.workers)
    print(json.dumps([asdict(row) for row in rows]) if options.json else table(rows))


if __name__ == "__main__":
    main()
