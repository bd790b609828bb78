"""The gap above noise and gusts alone, where the model itself does not stay in the air under the recorded controls."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from sim2real.closing import gap
from sim2real.closing.remedy import Remedy
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.windows import FARTHEST
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly


@cache
def flight() -> Reconstruction:
    chosen = scenario.load("clear_air", duration=32.0, parameters={"turbulence_sigma_w": 0.3})
    return reconstruct(fly(chosen, seed=5, observer=False, protection=False).record)


def with_number(name: str, value: float) -> gap.Energy:
    row = flight().parameters.copy()
    row[name] = value
    return gap.energies(replace(flight(), parameters=row), Remedy(), Gusts(0.3), 0)


@pytest.mark.parametrize(("damping", "all_of_them"), [(0.13, False), (0.3, True)])
def test_windows_in_which_the_model_departs_say_nothing_of_noise_and_gusts(damping: float, all_of_them: bool):
    """Roll damping of the wrong sign: the model's own flights end anywhere, its gap is still a number."""
    away = with_number("Cl_p", damping)
    departed = ~np.isfinite(away.alone).any(axis=2)  # [repeats, windows]
    assert departed.all() if all_of_them else 0.5 < departed.mean() < 1.0
    assert np.max(away.alone[np.isfinite(away.alone)], initial=0.0) < FARTHEST**2
    assert gap.g(away.before, away.alone) > max(gap.null_quantile(away.alone), 5.0)
    assert (gap.null_quantile(away.alone) == 0.0) is all_of_them


def test_a_model_that_stays_in_the_air_has_every_window():
    sound = with_number("Cl_p", -0.5)
    assert np.isfinite(sound.alone[:, :, 0]).all()
    assert gap.g(sound.before, sound.alone) < 1.2 * gap.null_quantile(sound.alone) + 0.05


def test_a_gap_above_nulls_of_which_some_are_blank_counts_the_others():
    energy = np.full((3, 2), 4.0)
    alone = np.ones((5, 3, 2))
    alone[:2] = np.nan
    assert gap.g(energy, alone) == np.sqrt(3.0)
    alone[:] = np.nan  # nothing is known of noise and gusts: the gap is all of what is left
    assert gap.g(energy, alone) == 2.0
