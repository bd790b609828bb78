"""Flies a setting with given effects and reads its instruments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere import sensors
from testbed.elsewhere.aircraft import derivatives
from testbed.elsewhere.effects import Effect
from testbed.elsewhere.flight import DT, Weather, fly, initial, time_axis
from testbed.elsewhere.gusts import dryden
from testbed.elsewhere.hooks import GROUPS, Channels, Hooks
from testbed.elsewhere.manoeuvres import Plan
from testbed.elsewhere.pilot import Pilot
from testbed.elsewhere.plant import Plant
from testbed.elsewhere.setting import Setting
from testbed.elsewhere.slow_air import slow_wind


def _weather(setting: Setting, time: NDArray, speeds: NDArray, rng: np.random.Generator) -> Weather:
    gust = [dryden(time.size, DT, v, setting.sigma, setting.rotational, rng) for v in speeds]
    wind = [slow_wind(time, *setting.slow, h, rng) for h in setting.headings]
    return Weather(np.stack(gust), np.stack(wind))


def _plant(setting: Setting, carries: NDArray, hooks: Sequence[Hooks]) -> Plant:
    """The true aircraft in three groups of columns and the published one, with the told loading, in the fourth."""
    n = carries.size
    book = np.repeat([0.0, 1.0], [3 * n, n])
    published = derivatives(centre=setting.centre)
    d = {name: value + book * (published[name] - value) for name, value in setting.aircraft.items()}
    told = np.array([load.mass for load in setting.loadings])
    inertia = np.stack([load.inertia for load in setting.loadings], 1)
    return Plant(d, np.concatenate([np.tile(setting.mass, 3), told]),
                 np.concatenate([np.tile(setting.inertia, 3), inertia], 1), np.concatenate([carries, np.zeros(3 * n)]),
                 hooks, setting.thrust_factor + book * (1.0 - setting.thrust_factor), setting.offset)


def simulate(setting: Setting, effects: Sequence[Effect], sizes: Sequence[float]
             ) -> tuple[list[Channels], list[Hooks]]:
    """Channels without noise of the four groups of `flight`, and what the effects hooked in."""
    rng = np.random.default_rng(setting.seed)
    n = len(setting.programme)
    hooks = [e.build(s, np.random.default_rng([setting.seed, i]), n)
             for i, (e, s) in enumerate(zip(effects, sizes, strict=True))]
    carries = np.array([role != "reference" for role, *_ in setting.programme], float)
    plant = _plant(setting, carries, hooks)
    speeds = np.array([card[2] for card in setting.programme])
    time = time_axis(40.0)
    x, surfaces, throttle = initial(plant, speeds, setting.altitudes, setting.headings)
    plans = [Plan(time, rng) for _ in range(n)]
    for plan, card in zip(plans, setting.programme, strict=True):
        card[1](plan, rng)
    pilot = Pilot(plans, surfaces, throttle, x, DT, setting.skill, rng)
    weather = _weather(setting, time, speeds, rng)
    log = fly(plant, pilot, weather, x, surfaces, time)
    groups = []
    for g in range(GROUPS):
        gust = weather.gust if g != 2 else np.zeros_like(weather.gust)
        columns = slice(g * n, (g + 1) * n)
        groups.append(sensors.read(log, columns, gust, speeds, setting.outfit["filter_hz"], DT))
    first = {k: v[..., :n, :] for k, v in log.items()}
    for hook in hooks:
        if hook.sense is not None:
            hook.sense(groups[0], first, carries[:, None], DT)
    return groups, hooks


def sane(channels: Channels) -> bool:
    """Whether the flight stayed where a linear model of the Twin Otter means something."""
    return bool(np.isfinite(channels["alpha"]).all() and channels["airspeed"].min() > 40.0
                and channels["airspeed"].max() < 95.0 and np.abs(channels["alpha"]).max() < 0.21
                and np.abs(channels["phi"]).max() < 1.05 and np.abs(channels["beta"]).max() < 0.30)
