"""Where a surface was: behind its command where that says it better than the noisy recorded position.

Noise of a position drives the model as if the surface shook, and the predictor then forgets what a steady moment does.
Commands are exact. Where a smooth law from the command (its actuator at the best lag, geared, shifted, bent, drifting)
leaves nothing of the recorded position but white noise, the surface was where that law has it, where the position was
not recorded too; else where it was recorded, noise and all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from icing_env.record import FloatArray
from sim2real.actuators.paths import POSITION_NOISE, follow
from sim2real.actuators.timing import LAGS
from sim2real.records.channels import SURFACES
from sim2real.records.instruments import UNFILTERED
from sim2real.records.noise import white
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.rounding import SEVERAL, rounding

PLACED = 3e-5  # rad, what a fitted law leaves (assumed: a position's noise over the root of the samples behind a term)
EXACT = 3e-6  # rad, the same of a law of which nothing but the lag is fitted (assumed)
DRIFTS = 6  # cosines over a record that a law's shift may take
SHARED, OWN = slice(0, 4), slice(4, None)  # columns of a basis: of an actuator, in all records; of each record
RATE = 2  # the column of an advance
NOTHING, GEARED, EVERY = (0, 0), (1, 1), (4, 1 + DRIFTS)  # how many of either a law has
AT_LIMIT = 0.98  # share of a rate limit that is at it
RATES, ANOTHER, TURNS = (-1.2, 1.2), (0.9, 1.1), 3  # logarithms of times the published limit; times it that are another
SCALES = (5, 25, 100)  # samples over which what is left has to average out as white noise does
SHORTEST, FINE = 1e-3, 1e-4  # s: least lag, and how finely it is found
Parts = tuple[FloatArray, FloatArray]  # of a law: the aircraft's, and a record's own [N, terms]
CHANCE, SURE = 1e-5, 1.05  # of white noise not to pass for it; what the noise itself may be off by (squared)


def placed(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records of one aircraft with every surface where its command puts it, if nothing but white noise is between."""
    moved = [(dict(flight.controls), flight.surface_noise.copy()) for flight in flights]
    for j, surface in enumerate(SURFACES):
        paths = list[_Path]()
        for flight, (controls, _) in zip(flights, moved, strict=True):
            command = flight.commands.get(f"{surface}_command")
            recorded = flight.positions[surface][np.isfinite(flight.positions[surface])]
            if command is not None and not len(recorded):
                # nothing says how well it follows: as uncertain as if it had been recorded
                controls[surface] = _behind(flight, command, surface, flight.parameters[f"{surface}_lag"][0], False)
            elif command is not None and np.any(recorded != recorded[:1]):  # neither absent nor stuck
                paths.append(_Path(flight, command, surface))
        for path, law in zip(paths, _laws(paths), strict=True):
            if law is not None:
                controls, noise = next(m for f, m in zip(flights, moved, strict=True) if f is path.flight)
                controls[surface], noise[j] = law
    return [replace(flight, controls=controls, surface_noise=noise)
            for flight, (controls, noise) in zip(flights, moved, strict=True)]


@dataclass(frozen=True)
class _Path:
    """One surface along one record that has its command and its positions."""

    flight: Reconstruction
    command: FloatArray
    surface: str
    quick: float = 1.0  # times the published rate limit

    @property
    def published(self) -> float:
        """The actuator's lag, s."""
        return float(self.flight.parameters[f"{self.surface}_lag"][0])

    @cached_property
    def good(self) -> NDArray[np.bool_]:
        """Steps at which the position was recorded [N]."""
        return np.isfinite(self.flight.positions[self.surface])

    @cached_property
    def recorded(self) -> FloatArray:
        """Positions where they were recorded, rad."""
        return self.flight.positions[self.surface][self.good]

    @cached_property
    def least(self) -> float:
        """Noise that rounding leaves, rad."""
        return rounding(self.recorded, SEVERAL)

    @property
    def known(self) -> float:
        """Times which what is left by a law is as large."""
        return max(1.0, self.least / POSITION_NOISE)

    def behind(self, lag: float, filtered: bool = True) -> Parts:
        """What the actuator at some lag makes of a position [N, terms]: what is the aircraft's, and the record's."""
        basis = _basis(_behind(self.flight, self.command, self.surface, lag, filtered, self.quick))
        return basis[:, SHARED], basis[:, OWN]

    def as_published(self) -> tuple[FloatArray, float]:
        """Positions [N] before the low pass that the published actuator makes, and how well they are known."""
        return self.behind(self.published, filtered=False)[0][:, 0], EXACT * self.known

    def limited(self) -> bool:
        """Whether its rate is at the limit somewhere."""
        limit = float(self.flight.parameters[f"{self.surface}_rate"][0]) * self.flight.dt
        moved = _behind(self.flight, self.command, self.surface, self.published, False)
        return bool(np.max(np.abs(np.diff(moved)), initial=0.0) > AT_LIMIT * limit)

    def alone(self) -> bool:
        """Whether nothing need be fitted."""
        shared, own = (part[self.good] for part in self.behind(self.published))
        return _published(self.recorded - shared[:, 0], np.column_stack([shared, own]), self.least)


def _laws(paths: Sequence[_Path]) -> list[tuple[FloatArray, float] | None]:
    """For each record positions [N] before its low pass, as commands make them, and how well they are known; or None.

    One law for all records: gear and lag are the aircraft's, and a record in which a surface hardly moves tells a gear
    1 % off, which is a roll damping 1 % off there. Where that leaves more than noise in one, its own.
    """
    if all(path.alone() for path in paths):
        return [path.as_published() for path in paths]
    paths = _at_their_rate(paths)
    together = _law(paths)
    return [law if law is not None or len(paths) == 1 else path.as_published() if path.alone() else _law([path])[0]
            for path, law in zip(paths, together, strict=True)]  # fmt: skip


def _at_their_rate(paths: Sequence[_Path]) -> Sequence[_Path]:
    """The same behind an actuator of another rate limit, which no source tells, where that leaves plainly less.

    A gear in front of the actuator is the inverse of such a limit behind it: that one is as likely as the published.
    """
    if not any(path.limited() for path in paths):
        return paths

    def of(quick: float) -> _Fit:
        return _Fit([replace(path, quick=quick) for path in paths], GEARED)

    in_front = 1.0
    for _ in range(TURNS):
        lag = _lag((fit := of(in_front)).square, paths[0].published)
        in_front = 1.0 / float(np.clip(fit.weights(fit.seen(lag))[0][0], *np.exp(RATES)))  # a dead one has none
    before, kept = min((of(quick).square(lag), quick) for quick in (1.0, in_front))
    if min(of(kept * other).square(lag) for other in ANOTHER) > before:
        return of(kept).paths
    for _ in range(TURNS):  # a slow actuator passes for a late one, and the other way about
        found = minimize_scalar(lambda log, lag=lag: of(float(np.exp(log))).square(lag), bounds=RATES, method="bounded",
                                options={"xatol": 1e-3})  # fmt: skip
        quick = float(np.exp(found.x))
        lag = _lag(of(quick).square, paths[0].published)
    noise = max(float(np.median([white(path.recorded) for path in paths])), *(path.least for path in paths), 1e-9)
    enough = 2.0 * np.log(sum(len(path.recorded) for path in paths))
    return of(quick if before - of(quick).square(lag) > enough * noise**2 else kept).paths


def _law(paths: Sequence[_Path]) -> list[tuple[FloatArray, float] | None]:
    """The simplest law that says where a surface was: for each record positions and how well they are known, or None.

    The published actuator, the same at another lag, geared and shifted, bent and drifting too. Every number fitted
    costs the logarithm of the samples (Schwarz, Annals of Statistics 6, 1978), for it is fitted to noise: a shift of
    4e-5 rad of an aileron, held for 40 s, is a rolling moment that everybody can see.
    """
    published = paths[0].published
    fits = [_Fit(paths, terms) for terms in (NOTHING, GEARED, EVERY)]
    laws = [*((fit, published, fit.count) for fit in fits[:2]),
            *((fit, _lag(fit.square, published), 1 + fit.count) for fit in fits)]  # fmt: skip
    noise = max(float(np.median([white(left) for left in fits[-1].left(laws[-1][1])])),
                *(path.least for path in paths), 1e-9)
    n = sum(len(path.recorded) for path in paths)
    cost = [fit.square(lag) / noise**2 + count * np.log(n) for fit, lag, count in laws]
    out = list[tuple[FloatArray, float] | None]()
    fitting = [[_nothing_else(left, path.least) for left, path in zip(fit.left(lag), paths, strict=True)]
               for fit, lag, _ in laws]  # fmt: skip
    best = min((k for k in range(len(laws)) if all(fitting[k])), key=lambda k: cost[k], default=None)
    best = best if best is not None else max(range(len(laws)), key=lambda k: (sum(fitting[k]), -cost[k]))
    fit, lag, count = laws[best]
    for path, there, fits_it in zip(paths, fit.positions(lag), fitting[best], strict=True):
        out.append((there, (PLACED if count > 1 else EXACT) * path.known) if fits_it else None)
    return out


@dataclass(frozen=True)
class _Fit:
    """A law's numbers at some lag: of `terms`, how many the aircraft has and how many every record has besides."""

    paths: Sequence[_Path]
    terms: tuple[int, int]

    @property
    def count(self) -> int:
        """Of numbers fitted, the lag apart."""
        return self.terms[0] + self.terms[1] * len(self.paths)

    def positions(self, lag: float) -> list[FloatArray]:
        """Of every record [N], before the recording's low pass."""
        return self._of([path.behind(lag, filtered=False) for path in self.paths], *self.weights(self.seen(lag)))

    def left(self, lag: float) -> list[FloatArray]:
        """What the recorded positions have beside."""
        seen = self.seen(lag)
        return [path.recorded - there[path.good]
                for path, there in zip(self.paths, self._of(seen, *self.weights(seen)), strict=True)]

    def seen(self, lag: float) -> list[Parts]:
        """What the law is made of behind the recording's low pass."""
        return [path.behind(lag) for path in self.paths]

    def weights(self, seen: list[Parts]) -> tuple[FloatArray, list[FloatArray]]:
        """Those of the aircraft, and of every record; the position itself where none is fitted."""
        shared, own = self.terms
        parts = [tuple(part[path.good] for part in both) for both, path in zip(seen, self.paths, strict=True)]
        first = np.eye(parts[0][0].shape[1])[0]
        if shared:
            inside = [_without(own_of[:, :own], np.column_stack([of_all[:, :shared], path.recorded]))
                      for (of_all, own_of), path in zip(parts, self.paths, strict=True)]
            first = np.zeros_like(first)
            first[:shared] = np.linalg.lstsq(np.vstack([columns[:, :-1] for columns in inside]),
                                             np.concatenate([columns[:, -1] for columns in inside]), rcond=None)[0]
        return first, [np.linalg.lstsq(own_of[:, :own], path.recorded - of_all @ first, rcond=None)[0]
                       for (of_all, own_of), path in zip(parts, self.paths, strict=True)]

    @staticmethod
    def _of(parts: list[Parts], first: FloatArray, beside: list[FloatArray]) -> list[FloatArray]:
        """What weights make of parts [N]."""
        return [np.asarray(of_all @ first + own_of[:, : len(more)] @ more)
                for (of_all, own_of), more in zip(parts, beside, strict=True)]

    def square(self, lag: float) -> float:
        """Sum of the squares of that."""
        return float(sum(left @ left for left in self.left(lag)))


def _without(own: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns less what `own` ones explain."""
    if not own.shape[1]:
        return columns
    q = np.linalg.qr(own)[0]
    return np.asarray(columns - q @ (q.T @ columns))


def _behind(flight: Reconstruction, command: FloatArray, surface: str, lag: float, filtered: bool, quick: float = 1.0
            ) -> FloatArray:  # fmt: skip
    """Positions [N] of the published actuator at some lag, behind the recording's low pass or before it."""
    row = flight.parameters.copy()
    row[f"{surface}_lag"], row[f"{surface}_rate"] = lag, quick * row[f"{surface}_rate"]
    if not filtered:
        row["filter_frequency"] = UNFILTERED
    return follow(command, command[0], row, surface, flight.dt)[:, 0]


def _published(left: FloatArray, basis: FloatArray, least: float) -> bool:
    """Whether nothing need be fitted: what the published actuator leaves is white, and no other law says it better.

    Another lag is to first order an advance.
    """
    square, cost = max(white(left), least, 1e-9) ** 2, np.log(len(left))

    def gain(columns: FloatArray) -> float:
        fitted = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
        return float(fitted @ fitted) / square

    return _nothing_else(left, least) and gain(basis[:, RATE : RATE + 1]) < cost and gain(basis) < 3.0 * cost


def _lag(square: Callable[[float], float], published: float) -> float:
    """The lag that leaves least."""
    lags = np.unique(np.maximum(published + LAGS, SHORTEST))
    k = int(np.argmin([square(lag) for lag in lags]))
    near = (lags[max(k - 1, 0)], lags[min(k + 1, len(lags) - 1)])
    return float(minimize_scalar(square, bounds=near, method="bounded", options={"xatol": FINE}).x)


def _basis(position: FloatArray) -> FloatArray:
    """What a smooth law may make of a position [N, terms]: gear, bend, advance, shift and drift."""
    rate = np.gradient(position)
    return np.column_stack([position, position**3, rate, np.gradient(rate), _slow(len(position))])


@lru_cache(maxsize=16)
def _slow(n: int) -> FloatArray:
    """Shift and drift over n samples [n, 1 + DRIFTS]."""
    return np.asarray(np.cos(np.pi * np.arange(DRIFTS + 1) * (np.arange(n)[:, None] + 0.5) / n))


def _nothing_else(left: NDArray, least: float) -> bool:
    """Whether means over SCALES of samples are as small as the means of white noise, of `least` or more."""
    square = max(white(left), least, 1e-9) ** 2
    for m in SCALES:
        if (count := len(left) // m) == 0:
            continue  # a short record
        means = left[: count * m].reshape(count, m).mean(axis=1)
        if np.mean(means**2) * m > SURE * square * chi2.ppf(1.0 - CHANCE, count) / count:
            return False
    return True
