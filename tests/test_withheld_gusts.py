"""The generator's gusts of every kind: spectra of MIL-F-8785C, and what the aircraft meets of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from testbed.commands.benchmark import GUSTS
from testbed.withheld import draw, gusts, separation
from testbed.withheld import plant as pl
from testbed.withheld.conditions import KINDS, Conditions
from testbed.withheld.distance import whitener
from testbed.withheld.published import PUBLISHED

V, RATE = 65.0, pl.SUB / pl.DT  # m/s, Hz
SPAN = PUBLISHED["span"]


def drawn(kind: str, seed: int = 1, seconds: float = 4000.0) -> np.ndarray:
    return gusts.draw(round(seconds / pl.DT), 1.0, 1.0, V, np.random.default_rng(seed), kind)


def spectra(f: np.ndarray) -> dict[int, np.ndarray]:
    """One-sided spectra per Hz for 1 m/s above 2000 ft, written out from the document."""
    w, length = 2.0 * math.pi * f, 533.4
    t = length / V
    across = t / math.pi * (1 + 3 * (t * w) ** 2) / (1 + (t * w) ** 2) ** 2
    lag = 4.0 * SPAN / (math.pi * V)
    p = 0.8 * (math.pi * length / (4 * SPAN)) ** (1 / 3) / (V * length) / (1 + (lag * w) ** 2)
    q, r = ((w / V) ** 2 / (1 + (by * lag * w) ** 2) * across for by in (1.0, 0.75))
    return {column: 2.0 * math.pi * one for column, one in ((pl.G_V, across), (pl.G_W, across), (pl.G_P, p),
                                                            (pl.G_Q, q), (pl.G_R, r))}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_spectra_are_those_of_the_document_and_the_rest_is_nothing(kind):
    found = drawn(kind)
    there = {"later": (), "at_once": (), "turning": (pl.G_P, pl.G_Q, pl.G_R), "rolling": (pl.G_P, pl.G_R)}[kind]
    assert {c for c in (pl.G_P, pl.G_Q, pl.G_R) if found[:, c].any()} == set(there)
    for column in (pl.G_V, pl.G_W, *there):
        f, measured = signal.welch(found[:, column], fs=RATE, nperseg=2**14)
        expected = spectra(f)[column]
        for low, high in ((0.05, 0.2), (0.2, 1.0), (1.0, 4.0)):
            band = (f >= low) & (f < high)
            assert measured[band].mean() == pytest.approx(expected[band].mean(), rel=0.15), (column, low)


@pytest.mark.parametrize("kind", KINDS)
def test_the_tail_meets_the_vertical_gust_later_or_at_once(kind):
    delay, found = kind in ("later", "rolling"), drawn(kind, seconds=400.0)
    wing, tail = found[:, pl.G_W], found[:, pl.G_TAIL]
    assert np.array_equal(wing, tail) != delay
    if delay:
        low = signal.butter(4, 1.0, fs=RATE, output="sos")
        a, b = (signal.sosfiltfilt(low, x)[2000:-2000] for x in (wing, tail))
        best = max(range(60), key=lambda k: float(np.mean(a[: a.size - k] * b[k:])))
        assert best / RATE == pytest.approx(PUBLISHED["tail_arm"] / V, abs=0.011)


def test_the_tails_delay_is_the_same_whether_the_air_turns():
    """Both are the document's Pade form."""
    spread = {kind: np.std(found[:, pl.G_TAIL] - found[:, pl.G_W]) for kind in ("later", "rolling")
              for found in (drawn(kind),)}  # fmt: skip
    assert spread["later"] == pytest.approx(spread["rolling"], rel=0.05)


@pytest.mark.parametrize("kind", ["later", "turning", "rolling"])
def test_air_turns_and_meets_the_tail_by_what_is_flown(kind):
    """Between samples the plant flies straight lines: along them the air turns by what v and w change, over V."""
    found, h = drawn(kind, seconds=40.0), pl.DT / pl.SUB
    lag = 4.0 * SPAN / (math.pi * V)
    yawing, pitching = (pl.G_R, pl.G_V, 0.75 * lag), (pl.G_Q, pl.G_W, lag)
    cases = {"turning": (yawing, pitching), "rolling": (yawing,)}
    for rate, gust, time in cases.get(kind, ()):
        turned = found[:, rate] * (1.0 if rate == pl.G_R else -1.0)
        behind = found[:, gust] - turned * time * V
        assert V * np.trapezoid(turned, dx=h) == pytest.approx(behind[-1] - behind[0], abs=1e-9)
    if kind != "turning":
        later = 0.5 * (found[:, pl.G_TAIL] + found[:, pl.G_W])
        missed = np.trapezoid(found[:, pl.G_TAIL] - found[:, pl.G_W], dx=h)
        assert missed == pytest.approx(-PUBLISHED["tail_arm"] / V * (later[-1] - later[0]), abs=1e-9)


def test_distances_know_the_kind_of_gusts():
    """Gusts that turn the air hide what acts on roll; the filter of each kind expects more or less of p."""
    root = {kind: np.diag(np.linalg.inv(whitener(V, Conditions(1.5, 1.0, 1.0, kind)).root)) for kind in KINDS}
    assert root["turning"][3] > 1.3 * root["later"][3] and root["rolling"][3] > 1.3 * root["at_once"][3]
    assert root["later"][4] != pytest.approx(root["at_once"][4], rel=1e-3)


def test_a_mixed_set_meets_every_kind_in_turn_and_is_else_the_same():
    usual = draw.USUAL.placed(draw.designs(40, 3), 3)
    mixed = draw.Population(gusts="mixed").placed(draw.designs(40, 3), 3)
    assert [sum(d.gusts == kind for d in mixed) for kind in KINDS] == [10] * 4
    assert {d.gusts for d in usual} == {"later"}
    assert [d.seed for d in mixed] == [d.seed for d in usual]
    assert draw.Population(gusts="mixed").told() == {"gusts": "mixed"} and not draw.USUAL.told()
    assert draw.Population.of({"gusts": "mixed", "count": 3}) == draw.Population(gusts="mixed")


def test_the_command_offers_every_kind():
    assert list(GUSTS) == [*KINDS, "mixed"]


@pytest.mark.parametrize("kind", KINDS)
def test_distances_of_an_effect_are_measured_in_every_kind(kind):
    shape = separation.geometry(0, 1.0, Conditions(0.5, 1.0, 1.0, kind))
    found = separation.distances(0, 1.0, shape, (("elevator_power", "same", -0.3),))
    assert 5.0 < found.none < 500.0
    assert found.rivals["elevator_power"] < 0.01 * found.none
