"""A known effect beside something unknown: found in what the unknown leaves, at the price of the chain rule."""

from dataclasses import replace

import pytest
from test_sets import typical, weighed, world

from sim2real.flown.beside_unknown import accompanied
from sim2real.posterior.form import WORTH, Form, Liberty
from sim2real.posterior.hypotheses import Hypothesis, Posterior


def strange(component: str) -> dict[int, float]:
    """Sixteen noise units of some terms of a component, by row."""
    rows = [term.row for term in world()[0].terms if term.component == component]
    return dict(zip(rows[1:4], (2.0, -2.0, 1.5), strict=True))


def alone(found: Posterior) -> Hypothesis:
    return next(h for h in found.hypotheses if h.unknown is not None and not h.effects)


@pytest.mark.parametrize("name", ["lift_slope", "alpha_bias"])
def test_what_is_there_beside_something_unknown_is_found_with_its_size(name):
    size = typical(world()[0], name, 1.2)
    found = weighed({name: size}, 11, strange("yawing_moment"))
    by_itself = alone(found)
    assert by_itself.unknown.component == "yawing_moment"
    (both,) = accompanied(found.hypotheses, found, world()[0])
    assert both.effects == (name,) and both.unknown.component == "yawing_moment"
    assert both.fit.low95[0] - 0.5 * abs(size) < size < both.fit.high95[0] + 0.5 * abs(size)
    assert both.fit.estimate[0] == pytest.approx(size, rel=0.4)
    # nearly as the fit of both together has it, which takes nothing from the effect for what its like may be unknown
    other = next(h for h in found.hypotheses if h.effects == (name,) and h.unknown is not None)
    assert both.log_prior == pytest.approx(other.log_prior)
    assert other.log_evidence - 20.0 < both.log_evidence < other.log_evidence
    assert both.log_evidence > by_itself.log_evidence + 300.0
    assert both.unknown.misfit == pytest.approx(other.unknown.misfit, abs=40.0)


def test_something_unknown_by_itself_has_no_company():
    for seed in range(4, 8):
        found = weighed({}, seed, strange("yawing_moment"))
        assert accompanied(found.hypotheses, found, world()[0]) == []


def test_an_effect_that_enters_where_it_is_unknown_is_no_company():
    """It would be a part of what is unknown."""
    found = weighed({"directional_stability": typical(world()[0], "directional_stability", 1.2)}, 11,
                    strange("yawing_moment"))  # fmt: skip
    assert all("directional_stability" not in h.effects for h in accompanied(found.hypotheses, found, world()[0]))


def test_nothing_is_sought_beside_what_is_hardly_there():
    found = weighed({"lift_slope": typical(world()[0], "lift_slope", 1.2)}, 11)
    by_itself = alone(found)
    faint = replace(by_itself, unknown=replace(by_itself.unknown, log_evidence=WORTH - 0.1))
    assert accompanied([faint], found, world()[0]) == []
    assert accompanied([replace(faint, unknown=replace(faint.unknown, log_evidence=WORTH))], found, world()[0])


def test_of_what_is_left_so_much_less_is_forgiven():
    found = weighed({"lift_slope": typical(world()[0], "lift_slope", 1.2)}, 11, strange("yawing_moment"))
    form = Form((0.0,), (900.0,), (Liberty(10.0, 1, 50.0, 890.0),))
    (both,) = accompanied([replace(alone(found), form=form)], found, world()[0])
    taken = alone(found).unknown.misfit - both.unknown.misfit
    assert taken > 600.0
    assert both.form.left == (900.0 - taken,) and both.form.free[0].beyond == 890.0 - taken
