"""The diagnosis on recorded flights of NASA's Twin Otter, beside what the textbook identified; and the paper's own gap.

Three cases. Longitudinal: diagnosed on one record, closed on another. Lateral: one record, diagnosed on its inputs
(the first 12 s), closed on the motion that follows them; the same flight, so a weaker test. The founding paper's own
gap: its severity eta is reset to zero at every activation of the boots, although its drag shows about 0.02 left behind
(`flight_010302f1_perfect_deicing` against `flight_010302f1`); flown, as the flight itself was never published.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from icing_env import aircraft
from icing_env.errors import InputError, nearest
from icing_env.record import FlightRecord, read
from icing_env.scenario import load
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.words import sentences
from testbed.flight import fly
from testbed.textbook import BOOK, folder

Progress = Callable[[str], None]
SPLIT = 12.0  # s into the lateral record: rudder 2-1-1 and aileron doublet before, the free motion after
# The derivative that an effect changes, by which the textbook's values tell its size; pitch_trim adds to Cm_0.
CHANGES = {
    "lift_slope": "CZ_alpha", "static_stability": "Cm_alpha", "pitch_damping": "Cm_q",
    "elevator_power": "Cm_elevator", "pitch_trim": "Cm_0", "side_force": "CY_beta", "aileron_power": "Cl_aileron",
    "dihedral_effect": "Cl_beta", "roll_damping": "Cl_p", "directional_stability": "Cn_beta",
    "rudder_power": "Cn_rudder",
}  # fmt: skip
CM_0 = {"totter_demo_data.mat": 0.0023}  # SIDPAC's demonstration on that record, beside the derivatives of BOOK
# Times [s] of flight_010302f1: set before any ice; sets after all boots, then after each of the three; the last set.
BEFORE, AFTER, LAST = (50.0, 130.0), ((1870.0, 1950.0), (3810.0, 3890.0)), (5770.0, 5850.0)


@dataclass(frozen=True)
class Known:
    """An effect whose size is known otherwise, and what the diagnosis says of it.

    Attributes:
        size: what it should be, in the effect's own unit.
        smallest: detection limit of the records; None where they could not have shown it.
        estimate, low95, high95: as diagnosed; None where it is not among the effects listed.
        probability: that it is part of the gap.
    """

    effect: str
    parameter: str
    size: float
    smallest: float | None
    estimate: float | None
    low95: float | None
    high95: float | None
    probability: float

    @property
    def outcome(self) -> str:
        """Right, wrong size, missed, or too small to be seen."""
        if self.probability >= 0.5 and self.low95 is not None and self.high95 is not None:
            return "right" if self.low95 <= self.size <= self.high95 else "named, size outside its interval"
        seen = self.smallest is not None and abs(self.size) >= abs(self.smallest)
        return "missed" if seen else "below its detection limit"


@dataclass(frozen=True)
class Case:
    """One diagnosis beside what is known of the aircraft."""

    name: str
    about: str
    sentences: list[str]
    verdict: str
    hypotheses: list[dict[str, Any]]
    known: list[Known]
    strangers: list[str]
    gap: dict[str, Any]
    channels: dict[str, float]
    tempering: float
    seconds: float


def longitudinal(progress: Progress) -> Case:
    """13 Feb 2002 #18 diagnosed, #17 held out."""
    name = "totter_demo_data.mat"
    found = diagnose([_recorded(name)], [_recorded("totter_pred_data.mat")], progress=progress)
    return _case("longitudinal", "13 Feb 2002 #18 diagnosed, #17 held out", found, textbook_sizes(name))


def lateral(progress: Progress) -> Case:
    """14 Feb 2002 #17, its first seconds diagnosed and the rest held out: one flight, split."""
    name = "totter_f1_017_data.mat"
    whole = _recorded(name)
    split = whole.time[0] + SPLIT
    found = diagnose([whole.slice(whole.time[0], split)], [whole.slice(split, whole.time[-1])], progress=progress)
    return _case("lateral", f"14 Feb 2002 #17, {SPLIT:.0f} s diagnosed, the rest of the same record held out", found,
                 textbook_sizes(name))


def residual_ice(progress: Progress) -> Case:
    """The founding flight after its boots, against a simulator whose boots leave nothing."""
    progress("flying 010302f1")
    windows = [BEFORE, *AFTER, LAST]
    flown = fly(load("flight_010302f1"), observer=False, protection=False, windows=windows)
    parts = [flown.record.slice(*window) for window in windows]
    found = diagnose(parts[1:3], parts[3:], reference=parts[:1], progress=progress)
    excess = [flown.truth["excess_CD_0"][(flown.truth["time"] >= a) & (flown.truth["time"] <= b)] for a, b in AFTER]
    drag = float(sum(map(sum, excess))/sum(map(len, excess)))
    return _case("residual_ice", "010302f1 after its boots, the model perfectly de-iced; the last set held out", found,
                 {"ice_drag": drag})


CASES: dict[str, Callable[[Progress], Case]] = {
    "longitudinal": longitudinal, "lateral": lateral, "residual_ice": residual_ice}


def measure(names: Sequence[str] = (), progress: Progress = lambda text: None) -> list[Case]:
    """Every case asked for, all if none is; those of recorded flights only where the records are.

    Raises:
        InputError: no such case, or one asked for by name whose records are absent.
    """
    for name in names:
        if name not in CASES:
            raise InputError(f"no case '{name}' of real flight: {nearest(name, list(CASES))}")
    here = folder().is_dir()
    if not here and set(names) - {"residual_ice"}:
        raise InputError(f"no recorded flights in {folder()}: set ICING_FLIGHT_DATA to the folder of SIDPAC's records")
    if not here and not names:
        progress(f"no recorded flights in {folder()} (ICING_FLIGHT_DATA): the founding paper's own gap alone")
    return [case(progress) for name, case in CASES.items()
            if (name in names or not names) and (here or name == "residual_ice")]


def textbook_sizes(name: str) -> dict[str, float]:
    """How large each effect of CHANGES is, by the textbook's values of one record against the published model."""
    model, book = aircraft.load()[0], BOOK[name]
    sizes = {effect: float(book[d])/float(model[d]) - 1.0 for effect, d in CHANGES.items() if d in book}
    if name in CM_0:
        sizes["pitch_trim"] = CM_0[name] - float(model["Cm_0"])
    return sizes


def _recorded(name: str) -> FlightRecord:
    return read(Path(folder()) / name)


def _case(name: str, about: str, found: Diagnosis, sizes: dict[str, float]) -> Case:
    listed = {e["name"]: e for e in found.effects}
    known = []
    for effect, size in sizes.items():
        limit = found.detection_limits.get(effect, {"parameter": "change", "smallest": None})
        parameter = limit["parameter"]
        told = listed[effect]["parameters"][parameter] if effect in listed else dict.fromkeys(
            ("estimate", "low95", "high95"))
        known.append(Known(effect, parameter, size, limit["smallest"], told["estimate"], told["low95"], told["high95"],
                           listed[effect]["probability"] if effect in listed else 0.0))
    strangers = [e for e, entry in listed.items() if entry["probability"] >= 0.5 and e not in sizes]
    return Case(name, about, sentences(found), found.verdict, found.hypotheses[:5], known, strangers, found.gap,
                found.where["channels"], float(found.provenance["tempering"]), found.seconds)


def tables(found: Sequence[Case]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """What is known beside what is found, a table per case."""
    headers = {"effect": "left", "known": "right", "could be seen from": "right", "found": "right", "95 %": "left",
               "probability": "right", "": "left"}
    out = []
    for case in found:
        rows = [[f"{k.effect} {k.parameter}", f"{k.size:+.3g}", _number(k.smallest), _number(k.estimate),
                 "" if k.low95 is None else f"{k.low95:+.3g} .. {k.high95:+.3g}", f"{k.probability:.2f}", k.outcome]
                for k in case.known]
        rows += [[name, "", "", "", "", "", "named, nothing is known of it"] for name in case.strangers]
        out.append((f"{case.name}: {case.about}", headers, rows))
    return out


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:+.3g}"
