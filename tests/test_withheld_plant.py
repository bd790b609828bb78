"""The benchmark's own plant against the simulator: the same flight, and the same effects where forms are the same."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env import effects as library
from icing_env.simulate import Fleet
from sim2real.records.channels import TOLERANCE
from testbed.withheld import compiled, described, effects, manoeuvres, refly
from testbed.withheld import plant as pl
from testbed.withheld.flights import Aircraft, Flown, fly
from testbed.withheld.instruments import FAST
from testbed.withheld.published import DERIVATIVES

CRUISE = manoeuvres.PLANS[0][1]
# Both follow the same document; the integrators and steps differ, and the recording's low pass is told to a step.
CLOSE = 0.02  # tolerances of 14 CFR Part 60 and the like
SURFACES = ("elevator", "aileron", "rudder")


def flown_again(flown: list[Flown], parameters: NDArray, samples: int) -> dict[str, NDArray]:
    """The simulator from each flight's start under its commands, without noise: channels [flights, samples]."""
    p = parameters.copy()
    for name in p.dtype.names:
        if name.startswith("noise_"):
            p[name] = 0.0
    fleet = Fleet(p, len(flown), pl.DT, 4)
    y = np.array([f.states[0] for f in flown])
    s = fleet.state
    for name, column in (("altitude", pl.H), ("u", pl.U), ("v", pl.V), ("w", pl.W), ("p", pl.P), ("q", pl.Q),
                         ("r", pl.R), ("elevator", pl.DE), ("aileron", pl.DA), ("rudder", pl.DR),
                         ("power_left", pl.PL), ("power_right", pl.PR), ("alpha_downwash", pl.ADW)):  # fmt: skip
        s[name] = y[:, column]
    half_phi, half_theta = y[:, pl.PHI] / 2, y[:, pl.THETA] / 2
    s["e0"], s["e1"] = np.cos(half_phi) * np.cos(half_theta), np.sin(half_phi) * np.cos(half_theta)
    s["e2"], s["e3"] = np.cos(half_phi) * np.sin(half_theta), -np.sin(half_phi) * np.sin(half_theta)
    names = (*SURFACES, "throttle_left", "throttle_right")
    out = {c: np.empty((len(flown), samples)) for c in FAST}
    for k in range(samples):
        for j, name in enumerate(names):
            fleet.command[name] = [f.commands[k, j] for f in flown]
        fleet.start() if k == 0 else fleet.step()
        for c in FAST:
            out[c][:, k] = fleet.measurement[c]
    return out


def test_calm_flight_is_the_simulators():
    still = fly(Aircraft(), CRUISE)
    ours = flown_again([still], aircraft.load(), 2001)
    for c in FAST:
        allowed = CLOSE * TOLERANCE[c] if c in TOLERANCE else 2e-3
        assert np.max(np.abs(ours[c][0] - still.channels[c])) < allowed, c


@pytest.mark.parametrize("off", [0.0, 0.12])
def test_effects_of_the_same_form_are_the_librarys(off):
    """In the published aircraft, and in one whose own derivatives are off: a size is a share of the aircraft's own."""
    own = {name: 1.0 + (off if i % 3 else -off) for i, name in enumerate(DERIVATIVES)}
    published, samples, parts, rows = aircraft.load(), 600, [], []
    for name, factor in own.items():
        published[name] *= factor
    for effect in effects.EFFECTS:
        parts.append((effect.name, "same", effect.typical))
        rows.append(library.with_effects(published, {effect.name: {effect.parameter: effect.typical}}))
    p = np.concatenate(rows)
    p["wind_reference_altitude"] = 2200.0
    flown = [fly(Aircraft(own, (part,)), CRUISE) for part in parts]
    ours, still = flown_again(flown, p, samples), fly(Aircraft(own), CRUISE)
    wrong = {}
    for i, part in enumerate(parts):
        for c in FAST:
            size = np.max(np.abs(flown[i].channels[c][:samples] - still.channels[c][:samples]))
            allowed = (CLOSE * TOLERANCE[c] if c in TOLERANCE else 2e-3) + 0.05 * size
            error = np.max(np.abs(ours[c][i] - flown[i].channels[c][:samples]))
            if error > allowed:
                wrong[part[0], c] = error / allowed
    assert not wrong, sorted({name for name, _ in wrong})


def test_what_describes_something_unknown_acts_as_in_the_simulator():
    """Every number that an answer may add, at a size that moves the aircraft by some tolerances."""
    moves = {"CX": 0.01, "CY": 2e-3, "CZ": 0.02, "Cl": 5e-4, "Cm": 0.01, "Cn": 5e-4}
    of = {"airspeed": 4.0, "airspeed2": 4.0 * 72.0, "time": 12.0, "elevator": 0.05, "alpha2": 0.002, "alpha_beta": 4e-4,
          "alpha_elevator": 0.002, "elevator2": 1e-3, "alpha3": 1e-4, "elevator3": 5e-5, "q3": 1e-8, "beta3": 1e-4,
          "p3": 1e-5, "r3": 1e-5, "aileron3": 5e-4, "rudder3": 1e-4, "beta2": 2e-3, "rudder2": 2e-3, "alpha_q": 2e-4,
          "alpha_CT": 1e-3, "alphadot": 2e-3, "elevator_airspeed": 2.0, "aileron": 0.05, "p": 0.01, "r": 0.01,
          "q": 2e-3, "theta": 0.05, "phi": 0.1, "alpha_p": 5e-4, "alpha_rudder": 2e-3, "beta_CT": 3e-4, "betadot": 5e-3,
          "alpha_r": 5e-4, "aileron_airspeed": 4.0, "CT": 0.01, "alpha": 0.05, "alpha_aileron": 3e-3,
          "rudder_airspeed": 3.0}  # fmt: skip
    sizes = {name: moves[name[:2]] / of[name[3:]] for name in (*refly.DESCRIBED, *described.OWN)}
    p = np.repeat(aircraft.load(), len(sizes))
    for i, (name, size) in enumerate(sizes.items()):
        p[name][i] = size
    flown, still = [fly(Aircraft(terms={name: size}), CRUISE) for name, size in sizes.items()], fly(Aircraft(), CRUISE)
    samples = 1000  # ailerons and rudder from 11 s on
    ours = flown_again(flown, p, samples)
    for i, name in enumerate(sizes):
        moved = {c: np.max(np.abs(flown[i].channels[c][:samples] - still.channels[c][:samples])) for c in FAST}
        assert max(moved[c] / TOLERANCE[c] for c in FAST if c in TOLERANCE) > 0.05, name
        for c in FAST:
            share = 0.3 if name.endswith("dot") else 0.05  # rates of the flow are otherwise late there
            allowed = (CLOSE * TOLERANCE[c] if c in TOLERANCE else 2e-3) + share * moved[c]
            assert np.max(np.abs(ours[c][i] - flown[i].channels[c][:samples])) < allowed, (name, c)


def test_every_effect_of_the_library_but_turbulence_is_drawn():
    assert {e.name for e in effects.EFFECTS} == set(library.LIBRARY) - {"turbulence"}
    for effect in effects.EFFECTS:
        typical = library.LIBRARY[effect.name].typical()
        assert effect.typical == pytest.approx(typical[effect.parameter])


def test_the_generator_and_the_scorer_load_nothing_of_the_project():
    code = ("import sys, testbed.withheld.generate, testbed.withheld.score; "
            "print([m for m in sys.modules if m.split('.')[0] in ('icing_env','sim2real','estimators','controllers')])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_change_of_any_source_is_compiled_anew(tmp_path):
    (tmp_path / "plant.py").write_text("x = 1\n")
    before = compiled.folder(tmp_path)
    compiled.folder.cache_clear()
    assert compiled.folder(tmp_path) == before
    (tmp_path / "plant.py").write_text("x = 2\n")
    compiled.folder.cache_clear()
    assert compiled.folder(tmp_path) != before
    assert pl.fly._cache.cache_path.startswith(compiled.folder())
