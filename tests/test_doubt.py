"""What is left for doubt: never all, never for no gap where there is one, mostly for the next in rank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim2real.flown.companions import CERTAIN
from sim2real.library.candidates import bank
from sim2real.over_time.varying import varying
from sim2real.posterior.forgiveness import ELSEWHERE, _in_larger, _leaking, elsewhere
from sim2real.posterior.form import SHARES
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import (
    DOUBT,
    MOST_DOUBT,
    UNSEEN,
    Hypothesis,
    Posterior,
    doubt,
    doubted,
    normalised,
)
from sim2real.posterior.sets import SetFit

SOMETHING = UnknownFit("x_force", 0.0, (("1", 1.0, 0.1),), 0.0, {})


def one(*names: str) -> SetFit:
    """A set of effects that nobody flew."""
    return SetFit(tuple(next(f for f in bank().families if f.effect.name == name) for name in names))


def some(logs: list[float]) -> list[Hypothesis]:
    """No gap, and something unknown as often as there are further logs of evidence."""
    return [Hypothesis(SetFit(), None if k == 0 else SOMETHING, -1.0 - k, log) for k, log in enumerate(logs)]


@given(st.lists(st.floats(-400.0, 400.0), min_size=2, max_size=6))
def test_doubt_keeps_the_order_of_what_is_certain_and_sums_to_one(logs):
    found = normalised(some(logs), 0.0)
    after = doubted(found)
    assert sum(h.probability for h in after) == pytest.approx(1.0)
    doubts = doubt(found[0]) if found[0].things else 0.0
    assert all(h.probability >= (1.0 - doubts) * before.probability - 1e-12
               for before in found for h in after if h.log_posterior == before.log_posterior)
    if found[0].probability > 0.6:
        assert after[0].log_posterior == found[0].log_posterior


def test_doubt_about_a_gap_is_for_other_explanations_of_it():
    after = doubted(normalised(some([0.0, 300.0, 250.0, 200.0]), 0.0))
    assert [h.log_evidence for h in after] == [300.0, 250.0, 200.0, 0.0]
    assert after[0].probability < 1.0 - 0.4 * DOUBT
    assert after[1].probability > 0.25 * DOUBT
    assert after[-1].probability < 0.1 * DOUBT


def told(*names: str, unknown: UnknownFit | None = None, log: float = 300.0, regained: float = 0.0) -> Hypothesis:
    """An explanation, its prior as if nothing were known."""
    return Hypothesis(one(*names) if names else SetFit(), unknown, -3.0, log, regained=regained)


@given(st.floats(-10.0, 1e6), st.floats(0.0, 1e5))
def test_doubt_grows_as_the_library_s_own_form_fails(regained, more):
    less, own = told("wing_ice", regained=regained), told("wing_ice", regained=regained + more)
    assert DOUBT <= doubt(less) <= doubt(own) <= MOST_DOUBT


def test_doubt_grows_with_the_causes_that_are_named():
    single, pair, three = told("wing_ice"), told("roll_trim", "wing_ice"), told("cg_shift", "roll_trim", "wing_ice")
    assert doubt(single) < doubt(pair) < doubt(three)
    assert doubt(told("wing_ice", unknown=SOMETHING)) == doubt(three)


def test_what_seems_unknown_is_doubted_more_than_a_known_effect():
    """Of 200 opened answers 168 were right, of 249 of a known effect in the library's form 243."""
    assert doubt(told("wing_ice")) < doubt(told(unknown=SOMETHING)) < doubt(told("wing_ice", unknown=SOMETHING))


@pytest.mark.parametrize(("best", "parts"), [
    (told("roll_trim", "wing_ice"), [told("roll_trim", log=40.0), told("wing_ice", log=20.0)]),
    (told("wing_ice", unknown=SOMETHING), [told(unknown=SOMETHING, log=40.0), told("wing_ice", log=20.0)]),
    (told("cg_shift", "roll_trim", "wing_ice"), [told("cg_shift", "roll_trim", log=40.0)]),
])
def test_what_is_doubted_of_several_causes_is_mostly_one_of_them(best, parts):
    """Also parts that are less probable than what is kept of other sets, and however many rank before them."""
    others = [told(name, log=200.0 - k) for k, name in enumerate(("alpha_bias", "alpha_scale", "fin_ice"))]
    after = doubted(normalised([told(log=0.0), *parts, best, *others]))
    found = {(h.effects, h.unknown is not None): h.probability for h in after}
    assert after[0].effects == best.effects
    assert found[parts[0].effects, parts[0].unknown is not None] > 0.3 * doubt(best)
    assert sum(found[p.effects, p.unknown is not None] for p in parts) > 0.5 * doubt(best)
    assert sum(found.values()) == pytest.approx(1.0)


def test_what_another_form_explains_is_doubted_more_and_half_of_that_is_for_something_unknown():
    def weighed(regained: float) -> dict[tuple[tuple[str, ...], bool], float]:
        after = doubted(normalised([told(log=0.0), told("wing_ice", log=300.0 - regained, regained=regained),
                                    told("fin_ice", log=100.0), told("wing_ice", unknown=SOMETHING, log=90.0),
                                    told(unknown=SOMETHING, log=10.0)], 0.0))
        return {(h.effects, h.unknown is not None): h.probability for h in after}

    exact, bent = weighed(0.0), weighed(200.0)
    for found, share in ((exact, DOUBT), (bent, MOST_DOUBT)):
        assert found[("wing_ice",), False] == pytest.approx(1.0 - share, abs=0.01)
        assert found[("wing_ice",), True] < 0.1 * share  # never something unknown beside what is told
        assert found[(), False] < 0.001
    assert exact[(), True] < 0.01
    assert bent[(), True] - exact[(), True] == pytest.approx(0.5 * (MOST_DOUBT - DOUBT), abs=0.015)


@pytest.mark.parametrize(("log", "gap", "unknown"), [(-1.0, 0.2, UNSEEN), (-4.0, 0.02, 0.0134), (-12.0, 7e-6, 5e-6)])
def test_no_gap_is_not_doubted_but_of_the_rest_something_unknown_may_be_most(log, gap, unknown):
    """Of 451 clean answers at more than 0.95 nine had something unknown, three an effect."""
    found = normalised([told(log=0.0), told("wing_ice", log=log), told(unknown=SOMETHING, log=log - 5.0)], 0.0)
    after = {(h.effects, h.unknown is not None): h.probability for h in doubted(found)}
    assert after[(), False] == found[0].probability
    assert 0.5 * gap < 1.0 - after[(), False] < 2.0 * gap
    assert after[(), True] == pytest.approx(unknown, rel=0.5)
    assert sum(after.values()) == pytest.approx(1.0)


def test_what_clean_records_say_of_something_unknown_is_not_lowered():
    found = normalised(some([0.5, 0.0, 1.0]), 0.0)
    assert found[0].unknown is None
    assert [h.probability for h in doubted(found)] == [h.probability for h in found]


@given(st.floats(-5.0, 4000.0), st.floats(0.0, 1.0))
def test_company_of_another_form_is_less_by_what_forms_leave_elsewhere(regained, ahead):
    """Where it leads by no more than that; beside one that is far behind, and beside none, it is as it was."""
    least = elsewhere(regained, 0.0)
    near = 105.0 + regained + ahead * least  # a log posterior that leads updraft's by a part of that
    found = [Hypothesis(one("updraft"), None, -5.0, 110.0, regained=regained),
             Hypothesis(one("updraft"), SOMETHING, -9.0, near + 9.0),
             Hypothesis(one("updraft", "wing_ice"), None, -10.0, near + 10.0),
             Hypothesis(one("fin_ice", "updraft"), None, -10.0, 1e4),
             Hypothesis(one("fin_ice", "wing_ice"), None, -10.0, 50.0),
             Hypothesis(one("wing_ice"), SOMETHING, -9.0, 50.0), Hypothesis(SetFit(), SOMETHING, -3.0, -80.0)]
    less = [before.log_posterior - after.log_posterior
            for before, after in zip(found, _leaking(found, 0.0), strict=True)]
    assert less == pytest.approx([0.0, least, least, 0.0, 0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(("lead", "share"), [(0.5, 1.0), (1.5, 0.5), (2.0, 0.0), (9.0, 0.0)])
def test_company_of_something_unknown_is_less_by_what_its_terms_leave_elsewhere(lead, share):
    """They describe it as a form describes an effect: a little is left for another."""
    alone = replace(SOMETHING, log_evidence=900.0)
    most = elsewhere(900.0, 0.0)
    found = [Hypothesis(SetFit(), alone, -4.0, 900.0),
             Hypothesis(one("updraft"), alone, -10.0, 906.0 + lead * most),
             Hypothesis(one("rudder_lag"), alone, -10.0, 906.0 + lead * most)]  # which no flight shows
    less = [h.regained - after.regained for h, after in zip(found, _leaking(found, 0.0), strict=True)]
    assert less == pytest.approx([0.0, share * most, 0.0], abs=1e-9)


def test_company_is_less_by_less_the_farther_it_leads():
    for lead, share in ((0.5, 1.0), (1.0, 1.0), (1.5, 0.5), (2.0, 0.0), (9.0, 0.0)):
        found = [Hypothesis(one("updraft"), None, 0.0, 0.0, regained=400.0),
                 Hypothesis(one("updraft", "wing_ice"), None, 0.0, 400.0 + lead * elsewhere(400.0, 0.0))]
        assert found[1].regained - _leaking(found, 0.0)[1].regained == pytest.approx(share * elsewhere(400.0, 0.0))


def test_what_a_form_leaves_elsewhere_goes_with_its_amplitude():
    assert elsewhere(-3.0, -3.0) == 0.0
    assert elsewhere(1.0, 1.0) == ELSEWHERE
    assert elsewhere(400.0, 0.0) == pytest.approx(2.0 * elsewhere(100.0, 0.0))


def test_even_the_library_s_form_leaves_a_hundredth_of_what_it_explains():
    """An idle companion of an effect that explains four million: a lead of 15 is nothing, one of 50 is company."""
    assert elsewhere(0.0, 4e6) == pytest.approx(20.0)
    for lead, less in ((15.0, 20.0), (50.0, 0.0)):
        found = [Hypothesis(one("asymmetric_ice"), None, 0.0, 0.0),
                 Hypothesis(one("asymmetric_ice", "inertia_error"), None, 0.0, lead)]
        assert found[1].regained - _leaking(found, 4e6)[1].regained == pytest.approx(less)


def test_three_regain_no_more_than_two_and_what_the_third_gives_reason_for():
    """The same terms about another point are a little better or worse; that is no reason to name a third effect."""
    two, three = (replace(one(*names), misfit=left) for names, left in ((("updraft", "wing_ice"), 500.0),
                                                                       (("fin_ice", "updraft", "wing_ice"), 400.0)))
    found = [Hypothesis(two, None, -10.0, 140.0, regained=30.0), Hypothesis(three, None, -16.0, 150.0, regained=90.0)]
    assert [h.regained for h in _in_larger(found)] == [30.0, pytest.approx(30.0 + 0.5 * SHARES[-1] ** 2 * 100.0)]
    assert [h.regained for h in _in_larger(found[1:])] == [90.0]  # where no two were tried


def test_no_size_is_sought_that_varies_where_there_may_be_no_gap():
    found = normalised(some([0.5, 3.0]), 0.0)
    told = Posterior(found, {}, {}, np.zeros((1, 1)))
    assert told.best.unknown is not None and told.none > CERTAIN
    sure = Posterior(normalised(some([0.5, 300.0]), 0.0), {}, {}, np.zeros((1, 1)))
    with pytest.raises((AttributeError, ValueError)):  # there it looks at the records
        varying([None], bank(), [], None, sure, np.zeros(0))
    assert varying([None], bank(), [], None, told, np.zeros(0)) is told
