"""Third part of the demonstration: what NASA's flight records say of the aircraft, beside model and textbook."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass

from estimators.airframe import published_airframe
from estimators.estimate import Estimate
from estimators.hinf import record as hinf_record
from estimators.regression import equation_error
from icing_env.record import FlightRecord, read
from icing_env.scenario import load
from testbed.demo.parts import Tell, Verdict
from testbed.flight import fly
from testbed.textbook import BOOK, folder

TITLES = {"totter_demo_data.mat": "NASA record 13 Feb 2002 #18, longitudinal",
          "totter_f1_017_data.mat": "NASA record 14 Feb 2002 #17, lateral"}  # fmt: skip
PITCH = ("CL_alpha", "CL_q", "CL_elevator", "Cm_alpha", "Cm_q", "Cm_elevator")
LATERAL = tuple(BOOK["totter_f1_017_data.mat"])
STARTS = (0.4, 1.6)  # of the published model: far off on either side
CLOSE = 0.05  # by which two methods may differ, or two standard errors


@dataclass(frozen=True)
class Identified:
    """One record and what each method finds in it.

    Attributes:
        reference: values to compare with, as printed or as flown, by derivative.
        reference_name: what they are.
        published: the published model's derivatives.
        stored: equation error on the columns the record's owner stored; None where there are none.
        matched: equation error, our filters on the raw channels.
        hinf: H-infinity by start.
        runs: the observer's course by start.
    """

    title: str
    record: FlightRecord
    names: tuple[str, ...]
    reference: Mapping[str, str]
    reference_name: str
    published: Mapping[str, float]
    stored: Mapping[str, Estimate] | None
    matched: Mapping[str, Estimate]
    hinf: Mapping[float, Mapping[str, Estimate]]
    runs: Mapping[float, hinf_record.History]

    def agreeing(self) -> tuple[list[str], list[str]]:
        """Derivatives in which H-infinity, from both starts, agrees with equation error; and those in which not."""
        told = [n for n in self.names if self.matched[n].identifiable and all(h[n].identifiable
                for h in self.hinf.values())]  # fmt: skip
        close = [n for n in told if all(self._close(h[n], self.matched[n]) for h in self.hinf.values())]
        return close, [n for n in told if n not in close]

    @staticmethod
    def _close(a: Estimate, b: Estimate) -> bool:
        return abs(a.estimate - b.estimate) <= max(CLOSE*abs(b.estimate), 2.0*(a.std_error**2 + b.std_error**2)**0.5)

    def printed(self) -> tuple[int, int]:
        """How many textbook values the stored columns give to all printed digits, and of how many."""
        if self.stored is None:
            return 0, 0
        exact = [abs(self.stored[n].estimate - float(v)) <= 0.51*10.0**-len(v.split(".")[1])
                 for n, v in self.reference.items()]
        return sum(exact), len(exact)


def measure(seed: int, tell: Tell) -> list[Identified]:
    """Identify the recorded flights; a simulated one if none is there."""
    paths = [folder() / name for name in BOOK]
    if not all(path.is_file() for path in paths):
        tell("identifying a simulated record", 0.0)
        return [simulated(seed)]
    found = []
    for k, path in enumerate(paths):
        tell(f"identifying {path.name}", k/len(paths))
        names = LATERAL if "Cl_p" in BOOK[path.name] else PITCH
        found.append(_identified(TITLES[path.name], read(path), names, BOOK[path.name], "textbook", stored=True))
    return found


def simulated(seed: int) -> Identified:
    """The same for a record of the simulator, in clear air; its truth stands in the place of the textbook."""
    flight = fly(load("clear_air"), seed=seed)
    names = tuple(n for n in PITCH if n != "CL_q")
    truth = {n: f"{flight.truth[f'quasi_{n}'][0]:.4f}" for n in names}
    return _identified("Simulated record, clear air", flight.record, names, truth, "truth", stored=False)


def _identified(title: str, record: FlightRecord, names: tuple[str, ...], reference: Mapping[str, str],
                reference_name: str, *, stored: bool) -> Identified:
    return Identified(
        title, record, names, reference, reference_name, published(),
        equation_error.identify(record, "textbook") if stored else None, equation_error.identify(record, "matched"),
        {start: hinf_record.identify(record, start=start) for start in STARTS},
        {start: hinf_record.history(record, start=start) for start in STARTS})


def published() -> dict[str, float]:
    """The published model's derivatives by name; lift at zero angle of attack from its axial and normal forces."""
    row = published_airframe()[0]
    values = {name: float(row[name]) for name in row.dtype.names if "_" in name}
    lift = {"CL_alpha": values["CX_0"] - values["CZ_alpha"], "CL_q": -values["CZ_q"],
            "CL_elevator": -values["CZ_elevator"]}  # fmt: skip
    return values | lift


def verdicts(found: list[Identified]) -> list[Verdict]:
    """How the methods compare with one another and with the printed values."""
    said = []
    exact, of = (sum(numbers) for numbers in zip(*(i.printed() for i in found), strict=True))
    if of:
        said.append(Verdict(f"Real flight records: least squares on the stored columns gives {exact} of the {of} "
                            "printed textbook values to every digit.", "good" if exact == of else "caution"))
    else:
        said.append(Verdict("NASA's flight records were not found (set ICING_FLIGHT_DATA to their folder); a simulated "
                            "record was identified instead.", "caution"))
    close = [n for i in found for n in i.agreeing()[0]]
    apart = [n for i in found for n in i.agreeing()[1]]
    text = (f"The H-infinity observer, started at {STARTS[0]:g} and at {STARTS[1]:g} of the published model, agrees "
            f"with equation error in {len(close)} of {len(close) + len(apart)} derivatives that both call identifiable")
    text += f"; not in {', '.join(apart)}." if apart else "."
    said.append(Verdict(text, "good" if close and not apart else "caution"))
    return [*said, _of_the_model(found)]


def _of_the_model(found: list[Identified]) -> Verdict:
    """How far the published model is from what was flown: what a detector must not take for ice."""
    share = {n: i.matched[n].estimate/i.published[n] for i in found for n in i.names
             if i.matched[n].identifiable and i.published[n] != 0.0}  # fmt: skip
    far = max(share, key=lambda n: abs(math.log(abs(share[n]))))
    median = 100.0*statistics.median(abs(s - 1.0) for s in share.values())
    return Verdict(f"The published model is off by {median:.0f} % in the median derivative; the farthest, {far}, was "
                   f"found to be {share[far]:.2f} times the published value.", "info")
