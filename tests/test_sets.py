"""Sets of effects from inner products: the algebra agrees with brute force, the right set wins, nobody is forced."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim2real.library.candidates import Bank, bank
from sim2real.library.sizes import flown_weights, in_powers
from sim2real.posterior.attribution import Linear, attribute, with_prior
from sim2real.posterior.generic import beside
from sim2real.posterior.hypotheses import Posterior
from sim2real.posterior.sets import SetFit, descend, integrate, pairs, sizes_tried
from sim2real.where import components

SAMPLES = 900


@cache
def world() -> tuple[Bank, np.ndarray]:
    """The library with made-up signatures [samples, rows]: linear in the size, ten noise units at the typical one."""
    rng = np.random.default_rng(3)
    candidates = bank()
    rows = np.zeros((SAMPLES, candidates.size))
    for family in candidates.families:
        direction = rng.standard_normal(SAMPLES) * 30.0 / np.sqrt(SAMPLES)
        reach = abs(family.parameter.typical) or family.parameter.high
        for row, size in zip(family.rows, family.nodes, strict=True):
            rows[:, row] = -direction * (size - family.parameter.neutral) / reach
    for j in (*range(1, 1 + len(candidates.nuisances)), *(t.row for t in candidates.terms)):
        rows[:, j] = -rng.standard_normal(SAMPLES) * 5.0 / np.sqrt(SAMPLES)
    return candidates, rows


def flown(sizes: dict[str, float], seed: int = 0, other: float = 0.0, terms: dict[int, float] | None = None
          ) -> tuple[Bank, np.ndarray]:  # fmt: skip
    """Inner products of a record with these effects in it, and `other` noise units of something in no list.

    Or generic terms, so much of each by row.
    """
    candidates, rows = world()
    rng = np.random.default_rng(seed)
    left = rng.standard_normal(SAMPLES) + other * np.sin(np.arange(SAMPLES)) * np.sqrt(2.0 / SAMPLES)
    for family in candidates.families:
        if family.effect.name in sizes:
            for row, weight in flown_weights(family, sizes[family.effect.name]).items():
                left = left - weight * rows[:, row]
    for row, weight in (terms or {}).items():
        left = left - weight * rows[:, row]
    all_rows = np.column_stack([left, rows[:, 1:]])
    n = len(candidates.nuisances)
    return candidates, with_prior(all_rows.T @ all_rows, candidates, np.eye(n), np.zeros(n))


def weighed(sizes: dict[str, float], seed: int = 0, terms: dict[int, float] | None = None) -> Posterior:
    candidates, gram = flown(sizes, seed, terms=terms)
    return attribute(Linear(gram, candidates, (), np.zeros((len(candidates.nuisances),) * 2)))


def typical(candidates: Bank, name: str, share: float = 1.0) -> float:
    p = next(f.parameter for f in candidates.families if f.effect.name == name)
    return p.neutral + share * (p.typical - p.neutral)


@pytest.mark.parametrize("names", [(), ("lift_slope",), ("rudder_power", "alpha_bias"),
                                   ("lift_slope", "mass_error", "pitch_damping")])  # fmt: skip
def test_the_set_that_is_there_is_named_with_its_sizes(names):
    candidates, _ = world()
    sizes = {n: typical(candidates, n, 1.2) for n in names}
    found = weighed(sizes, 4)
    assert found.best.effects == tuple(sorted(names))
    assert found.best.unknown is None
    assert found.best.probability > 0.5
    for name, low, high in zip(found.best.fit.effects, found.best.fit.low95, found.best.fit.high95, strict=True):
        assert low - 0.5 * (high - low) < sizes[name] < high + 0.5 * (high - low)


def test_probabilities_sum_to_one_and_inclusion_counts_every_set():
    found = weighed({"lift_slope": typical(world()[0], "lift_slope", 0.5)}, 1)
    assert sum(h.probability for h in found.hypotheses) == pytest.approx(1.0, abs=1e-12)
    assert all(a.probability >= b.probability for a, b in zip(found.hypotheses, found.hypotheses[1:], strict=False))
    for name, p in found.effects.items():
        assert p == pytest.approx(sum(h.probability for h in found.hypotheses if name in h.effects))


def test_noise_alone_is_seldom_blamed_on_anything():
    """Ten records: a posterior whose priors are its odds blames few (3 or more of 10 at 5 % have p 0.01)."""
    blamed = sum(weighed({}, seed).none < 0.5 for seed in range(10))
    assert blamed < 3


@settings(max_examples=8)
@given(seed=st.integers(0, 10_000), a=st.floats(-0.9, 0.9), b=st.floats(-0.9, 0.9))
def test_powers_give_the_likelihood_that_the_signatures_give(seed, a, b):
    candidates, gram = flown({}, seed)
    problem = in_powers(gram, candidates.families)
    i, j = 3, 17
    x = np.array([[a, b]])
    inside = np.clip(x, problem.low[[i, j]], problem.high[[i, j]])
    modes = descend(problem, np.array([[i, j]]), inside)
    sizes = [float(s) for s in problem.size(np.array([i, j]), modes.x[0])]
    w = np.zeros(len(gram))
    w[0] = 1.0
    for m, size in zip((i, j), sizes, strict=True):
        for row, weight in flown_weights(candidates.families[m], size).items():
            w[row] = weight
    assert modes.cost[0] == pytest.approx(0.5 * w @ gram @ w, rel=1e-8)


def test_a_pairs_evidence_is_the_integral_over_both_sizes():
    candidates, gram = flown({"lift_slope": -0.1}, 2)
    problem = in_powers(gram, candidates.families)
    names = [f.effect.name for f in candidates.families]
    members = (names.index("lift_slope"), names.index("alpha_bias"))
    modes = pairs(problem, members, sizes_tried(problem))
    fit = integrate(problem, modes, 0)
    x = [np.linspace(problem.low[m], problem.high[m], 1501) for m in members]
    a, b = (1 + m * problem.degree + np.arange(problem.degree) for m in members)
    powers = [v[:, None] ** np.arange(1, problem.degree + 1) for v in x]
    own = [p @ problem.gram[c, 0] + 0.5 * np.einsum("ni,ij,nj->n", p, problem.gram[np.ix_(c, c)], p)
           for p, c in zip(powers, (a, b), strict=True)]  # fmt: skip
    cost = own[0][:, None] + own[1][None] + powers[0] @ problem.gram[np.ix_(a, b)] @ powers[1].T
    prior = problem.density(members[0], x[0])[:, None] * problem.density(members[1], x[1])[None]
    cell = (x[0][1] - x[0][0]) * (x[1][1] - x[1][0])
    brute = np.log(np.sum(np.exp(cost.min() - cost) * prior) * cell) - cost.min()
    assert fit.log_evidence == pytest.approx(brute, abs=0.1)


def test_something_unknown_beside_a_set_is_what_the_set_leaves():
    candidates, gram = flown({"lift_slope": -0.15}, 5)
    family = next(f for f in candidates.families if f.effect.name == "lift_slope")
    weights = flown_weights(family, -0.15)
    fit = SetFit((family,), 0.0, (-0.15,), (-0.16,), (-0.14,), np.array([[1e-4]]), weights)
    w = np.zeros(len(gram))
    w[0] = 1.0
    w[list(weights)] = list(weights.values())
    slope = dict(zip(family.rows, np.ones(len(family.rows)), strict=True))
    left = beside(gram, fit, [])
    assert left[0, 0] == pytest.approx(w @ gram @ w)
    projected = beside(gram, fit, [slope])
    assert 0.0 <= projected[0, 0] <= left[0, 0]


def test_components_are_inclusion_probabilities():
    found = weighed({"rudder_power": typical(world()[0], "rudder_power", 1.2)}, 7)
    enters_at = {f.effect.name: f.effect.enters_at for f in world()[0].families}
    shares = components(found, enters_at)
    for component in enters_at["rudder_power"]:
        assert shares[component] >= found.effects["rudder_power"] - 1e-9
    assert all(0.0 <= p <= 1.0 for p in shares.values())


def test_an_effect_is_seen_by_whichever_of_its_parameters_shows():
    """Of a clean record the likeliest is a parameter that nothing excites: it fits as well as none."""
    candidates, gram = flown({}, 5)
    own = [f for f in candidates.families if f.effect.name == "inertia_error"]
    shown = max(own, key=lambda f: f.parameter.name).parameter.name
    quiet = [row for f in own if f.parameter.name != shown for row in f.rows]
    gram[quiet], gram[:, quiet] = 0.0, 0.0
    fits = attribute(Linear(gram, candidates, (), np.zeros((len(candidates.nuisances),) * 2))).fits
    assert len(quiet) > 0 and fits["inertia_error"].family.parameter.name == shown
    assert fits["inertia_error"].smallest is not None
