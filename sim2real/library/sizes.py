"""An effect's size as a number: what is believed of it beforehand, and signatures as polynomials in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from icing_env.effects import Parameter
from icing_env.record import FloatArray
from sim2real.library.candidates import Family

OTHER_SIGN = 0.25  # prior share of sizes of the sign opposite to the typical one (assumed)
WIDTH = 0.9  # standard deviation of log|s / typical| (assumed)
TABLE, FINEST = 1201, 4001  # points of a tabulated prior, and of one that is only summed


def size_prior(parameter: Parameter, size: FloatArray) -> FloatArray:
    """Density of an effect's size: log-normal about the typical one, a share with the other sign, inside its range."""
    reach = abs(parameter.typical) or 0.25 * max(parameter.high, -parameter.low)
    magnitude = np.maximum(np.abs(size - parameter.neutral), 1e-9 * reach)
    shape = np.exp(-0.5 * (np.log(magnitude / reach) / WIDTH) ** 2) / magnitude
    sign = np.sign(parameter.typical) or 1.0
    both = parameter.low < parameter.neutral < parameter.high
    other = OTHER_SIGN if both else 0.0
    if parameter.typical == parameter.neutral:
        other = 0.5
    density = shape * np.where(np.sign(size - parameter.neutral) == sign, 1.0 - other, other)
    total = float(np.sum(density * np.gradient(size)))
    return np.asarray(density / total) if total > 0.0 else density


def piece_prior(family: Family, size: FloatArray) -> FloatArray:
    """The same where a family is one piece of the range: it integrates to the piece's share of the whole."""
    return np.asarray(size_prior(family.parameter, size) * _share(family))


@cache
def _share(family: Family) -> float:
    """Prior probability of a piece of a parameter's range."""
    p = family.parameter
    whole = np.linspace(p.low, p.high, FINEST)
    inside = (whole >= family.low) & (whole <= family.high)
    return float(np.sum((size_prior(p, whole) * np.gradient(whole))[inside]))


@cache
def _tabulated(family: Family) -> FloatArray:
    """Prior density at TABLE sizes between the ends of a piece."""
    return piece_prior(family, np.linspace(family.low, family.high, TABLE))


@dataclass(frozen=True)
class Powers:
    """Inner products with every family's signature written in powers of its size x.

    x = (size - neutral)/reach, reach the farthest size flown, so that |x| <= 1; the signature is sum_k x^k E_k.

    Attributes:
        families: F of them.
        gram: [1 + F degree, 1 + F degree]; row 0 the residual, then E_1 ... E_degree of each family (zeros where a
            family was flown at fewer sizes).
        degree: powers kept of each family.
        neutral, reach, low, high: [F]; the ends of the range in x.
        prior: [F, TABLE] density of x between its ends.
    """

    families: tuple[Family, ...]
    gram: FloatArray
    degree: int
    neutral: FloatArray
    reach: FloatArray
    low: FloatArray
    high: FloatArray
    prior: FloatArray

    def size(self, members: FloatArray, x: FloatArray) -> FloatArray:
        """Sizes in their own units."""
        return np.asarray(self.neutral[members] + self.reach[members] * x)

    def density(self, members: NDArray[np.intp], x: FloatArray) -> FloatArray:
        """Prior density of x, of one member each; zero outside the range."""
        low, high = self.low[members], self.high[members]
        at = np.clip((x - low) / (high - low), 0.0, 1.0) * (TABLE - 1)
        before = np.minimum(at.astype(np.intp), TABLE - 2)
        found = self.prior[members, before] * (before + 1 - at) + self.prior[members, before + 1] * (at - before)
        return np.where((x < low) | (x > high), 0.0, found)


def in_powers(reduced: FloatArray, families: tuple[Family, ...]) -> Powers:
    """Turn inner products of flown sizes into inner products of powers (Lagrange's polynomials through the sizes)."""
    degree = max((len(f.nodes) for f in families), default=1)
    change = np.zeros((1 + len(families) * degree, len(reduced)))
    change[0, 0] = 1.0
    neutral = np.array([f.parameter.neutral for f in families])
    reach = np.array([max(abs(s - f.parameter.neutral) for s in f.nodes) for f in families])
    for m, family in enumerate(families):
        x = (np.array(family.nodes) - neutral[m]) / reach[m]
        powers = x[:, None] ** np.arange(1, len(x) + 1)  # signature(x_i) = sum_k x_i^k E_k
        first = 1 + m * degree
        change[first : first + len(x), list(family.rows)] = np.linalg.inv(powers)
    low = np.array([(f.low - f.parameter.neutral) for f in families]) / reach
    high = np.array([(f.high - f.parameter.neutral) for f in families]) / reach
    prior = np.array([_tabulated(f) for f in families]).reshape(-1, TABLE) * reach[:, None]
    return Powers(families, change @ reduced @ change.T, degree, neutral, reach, low, high, prior)


def interpolated(family: Family, sizes: FloatArray) -> FloatArray:
    """Weights of the flown sizes' signatures [sizes, rows of the family] in those at other sizes."""
    change, reach, degree = _through(family)
    return np.asarray(((sizes - family.parameter.neutral) / reach)[:, None] ** np.arange(1, degree + 1) @ change)


@cache
def _through(family: Family) -> tuple[FloatArray, float, int]:
    """Turns powers of x into weights of the sizes flown; what x counts in; and how many powers there are."""
    reach = max(abs(s - family.parameter.neutral) for s in family.nodes)
    x = (np.array(family.nodes) - family.parameter.neutral) / reach
    return np.asarray(np.linalg.inv(x[:, None] ** np.arange(1, len(x) + 1)), np.float64), reach, len(x)


def flown_weights(family: Family, size: float) -> dict[int, float]:
    """Weights of the flown sizes' signatures at one size, by row."""
    return dict(zip(family.rows, interpolated(family, np.array([size]))[0].tolist(), strict=True))
