"""Aircraft whose downwash does not lag, as a set of derivatives that is quasi-steady has it when taken by itself."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.effects import with_effects
from icing_env.record import FlightRecord
from sim2real.baseline.quasi_steady import NOTE, NUMBER, simpler, without_lag, worth_trying
from sim2real.baseline.references import Baseline
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import bank
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Settled
from sim2real.posterior.sets import SetFit
from testbed.flight import fly


@cache
def flown(sigma: float, lag: float, trim: float = 0.0) -> FlightRecord:
    """Doublets of all surfaces by an aircraft with so much of the published lag."""
    numbers = {"turbulence_sigma_w": sigma, "Cm_alphadot": lag * float(load()["Cm_alphadot"][0])}
    chosen = scenario.load("clear_air", duration=52.0, parameters=numbers,
                           effects={"pitch_trim": {"delta_Cm_0": trim}} if trim else {})
    return fly(chosen, seed=2, observer=False, protection=False).record


def noted(found) -> bool:
    return NOTE in found.provenance["records"][0]["notes"]


@pytest.mark.parametrize("sigma", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_an_aircraft_without_the_lag_has_no_gap_and_the_records_say_so(sigma):
    found = diagnose([flown(sigma, 0.0)])
    assert found.verdict == "no_gap" and noted(found)


@pytest.mark.slow
def test_what_else_it_has_is_told_alone_and_the_command_flies_both():
    found = diagnose([flown(0.5, 0.0, 0.02)])
    assert found.hypotheses[0]["effects"] == ["pitch_trim"] and noted(found)
    assert " --effect derivatives:" in found.resimulate["command"] and "Cm_alphadot=-1" in found.resimulate["command"]
    flies = with_effects(load(), {"derivatives": {"Cm_alphadot": -1.0}})
    assert flies["Cm_alphadot"][0] == 0.0 and flies["Cm_q"][0] == load()["Cm_q"][0]


def test_half_a_lag_is_a_gap_as_before():
    found = diagnose([flown(0.5, 0.5)])
    assert found.hypotheses[0]["effects"] == ["downwash_lag"] and not noted(found)


@pytest.mark.parametrize(("deviations", "effect", "worth"), [
    (-3.5, "pitch_trim", True), (-2.5, "pitch_trim", False), (3.5, "pitch_trim", False), (-3.5, None, False),
])  # fmt: skip
def test_a_trim_that_needs_less_lag_than_is_believed_is_weighed_without_it(deviations, effect, worth):
    candidates = bank()
    nuisances = np.zeros(len(candidates.nuisances))
    nuisances[[n.name for n in candidates.nuisances].index(NUMBER)] = deviations
    families = tuple(f for f in candidates.families if f.effect.name == effect)[:1]
    best = Hypothesis(SetFit(families), None, 0.0, 0.0, settled=Settled(nuisances, np.eye(len(nuisances))))
    baseline = Baseline(load(), np.eye(len(nuisances)))
    assert worth_trying(SimpleNamespace(best=best), baseline, candidates) == worth
    assert not worth_trying(SimpleNamespace(best=best), without_lag(baseline), candidates)


@pytest.mark.parametrize(("now", "before", "believed"), [
    ("elevator_power", (), True), ((), ("elevator_power",), True), ("downwash_lag", (), False),
])  # fmt: skip
def test_a_model_without_the_lag_is_not_believed_where_an_explanation_puts_it_back(now, before, believed):
    """About the model with it something unknown, about the other `downwash_lag`: the aircraft has the lag."""
    def told(effects: tuple[str, ...] | str) -> SimpleNamespace:
        names = (effects,) if isinstance(effects, str) else effects
        families = tuple(next(f for f in bank().families if f.effect.name == name) for name in names)
        unknown = None if isinstance(effects, str) or not names else UnknownFit("pitching_moment", 1.0, (), 0.0, {})
        return SimpleNamespace(best=Hypothesis(SetFit(families), unknown, 0.0, 0.0), tempering=1.0)

    first = told(before) if before else SimpleNamespace(
        best=Hypothesis(SetFit(), UnknownFit("pitching_moment", 1.0, (), 0.0, {}), 0.0, 0.0), tempering=1.0)
    assert simpler(told(now), first, np.eye(3)) == believed


@pytest.mark.parametrize(("left", "tempering", "believed"), [
    (60_000.0, 1.0, True), (64_000.0, 1.0, True), (80_000.0, 1.0, False), (2_300.0, 140.0, False),
])  # fmt: skip
def test_a_model_without_the_lag_that_loses_the_records_is_not_believed_for_its_one_cause(left, tempering, believed):
    """Two causes about the model with it, at the noise; one about the other, which takes the rest for strong gusts."""
    families = {f.effect.name: f for f in bank().families}
    two = SetFit((families["downwash_lag"], families["rudder_power"]), misfit=63_000.0)
    one = SetFit((families["roll_trim"],), misfit=left)
    first, again = (SimpleNamespace(best=Hypothesis(fit, None, 0.0, 0.0), tempering=t)
                    for fit, t in ((two, 1.0), (one, tempering)))
    assert simpler(again, first, np.eye(3)) == believed


@pytest.mark.parametrize(("without", "causes", "believed"), [
    (0.5, 1, True), (4.3, 1, False), (0.5, 2, False),
])  # fmt: skip
def test_of_models_that_tell_as_many_causes_the_one_is_believed_whose_other_numbers_are_less_odd(without, causes,
                                                                                                 believed):
    """A roll gyro's scale, which is in no library, in a quasi-steady aircraft: about the lagging model the lag is 4.9
    deviations off beside it. Numbers as odd as these were taken for an aircraft that differs in all of them."""
    def told(deviations: float, things: int) -> SimpleNamespace:
        nuisances = np.array([deviations, 1.0, 0.0])
        fit = SetFit(tuple(f for f in bank().families if f.effect.name == "roll_trim")[: things - 1])
        unknown = UnknownFit("sensor:p", 1.0, (), 0.0, {})
        best = Hypothesis(fit, unknown, 0.0, 0.0, settled=Settled(nuisances, np.eye(3)))
        return SimpleNamespace(best=best, tempering=1.0)

    assert simpler(told(without, causes), told(-4.9, 1), np.eye(3)) == believed
