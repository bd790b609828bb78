"""Terms that describe something unknown are told with their standard errors, the surest first."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim2real.closing.discrepancy import _written
from sim2real.closing.flyable import _of_path
from sim2real.library.terms import GENERIC

PATHS = {where: names for where, _, names in GENERIC if where in ("elevator_path", "aileron_path", "rudder_path")}


@pytest.mark.parametrize("path", PATHS)
@given(seed=st.integers(0, 10**6))
def test_terms_of_a_path_are_told_with_their_errors_the_surest_first(path, seed):
    terms, rng = [_of_path(path, name) for name in PATHS[path]], np.random.default_rng(seed)
    x, spread = rng.normal(size=len(terms)), rng.uniform(0.01, 1.0, len(terms))
    found = _written(path, terms, {}, x, np.ones(len(terms), bool), np.diag(spread**2))
    error = np.array([error for _, _, error in found.terms])
    assert np.all(error > 0.0)
    assert np.allclose(error, np.sqrt(np.diag(found.covariance)))
    sure = np.array([abs(size) for _, size, _ in found.terms]) / error
    assert np.all(np.diff(sure) <= 1e-9 * sure[:-1])
    told = dict(zip((term.term for term in terms), x, strict=True))
    assert all(size / told[name] == pytest.approx(next(t.size for t in terms if t.term == name))
               for name, size, _ in found.terms)  # fmt: skip
