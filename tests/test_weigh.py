"""What was found is flown again with gains of its own, and kept as it was where these lose it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_devices import one

from icing_env.aircraft import load
from sim2real.answer import judge
from sim2real.baseline.references import Baseline
from sim2real.diagnosis import _next
from sim2real.library.candidates import bank
from sim2real.posterior.hypotheses import Hypothesis, Posterior, normalised
from sim2real.weigh import LOSES, _Weighing


def posterior(best: str, left: dict[str, float], tempering: float = 1.0) -> Posterior:
    found = [Hypothesis(replace(one(name), misfit=square), None, -1.0, 10.0 if name == best else 0.0)
             for name, square in left.items()]  # fmt: skip
    return Posterior(normalised(found, 0.0), {}, {}, np.zeros((1, 1)), tempering=tempering)


@pytest.mark.parametrize(("ratio", "best"), [(1.0, "alpha_bias"), (LOSES + 0.01, "pitch_trim")])
def test_what_is_lost_with_gains_of_its_own_is_kept_as_it_was(monkeypatch, ratio, best):
    found = _Weighing([], bank(), Baseline(load(), np.eye(1)), {}, np.zeros(1))
    found.posterior, found.evidences = posterior("pitch_trim", {"pitch_trim": 1000.0, "alpha_bias": 1200.0}), ["first"]

    def judged_anew() -> bool:
        found.evidences = ["second"]
        return True

    def refine() -> None:
        left = {"pitch_trim": 500.0 * ratio, "alpha_bias": 600.0}
        found.posterior = posterior("alpha_bias", left, tempering=2.0)

    monkeypatch.setattr(_Weighing, "judged_anew", lambda self: judged_anew())
    monkeypatch.setattr(_Weighing, "refine", lambda self, before: refine())
    found.refine_anew(lambda text: None)
    assert found.posterior.best.effects == (best,)
    assert found.evidences == ["first" if best == "pitch_trim" else "second"]


def test_nothing_is_flown_again_where_gains_are_as_they_were(monkeypatch):
    found = _Weighing([], bank(), Baseline(load(), np.eye(1)), {}, np.zeros(1))
    found.posterior = before = posterior("pitch_trim", {"pitch_trim": 1000.0})
    monkeypatch.setattr(_Weighing, "judged_anew", lambda self: False)
    found.refine_anew(lambda text: pytest.fail("flown again"))
    assert found.posterior is before


def test_what_to_fly_next_is_asked_of_what_was_flown():
    """A member of a class that no explanation holds has no size to fly it with."""
    trim = Hypothesis(replace(one("pitch_trim"), estimate=(0.01,)), None, 0.0, 0.0)
    found = Posterior(normalised([trim], 0.0), {"pitch_trim": None}, {"pitch_trim": ("cg_shift",)}, np.zeros((1, 1)))
    assert _next(None, bank(), found, judge(found)[1], 0.5, np.eye(1)) is None
