"""The iced aircraft: bit-identical when clean, the UIUC percentages, the published shares, symmetry, bounds."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icing_env import severity
from icing_env.jit import kernel
from icing_env.types import CURRENT, DERIVATIVE_NAMES, STATE, SURFACES, structured

CLEAN = [*DERIVATIVE_NAMES, "CD_parasite", "alpha_stall", "alpha_tail_stall", "mass"]
PARAMETERS = structured([(name, "", "") for name in CLEAN] + severity.SEVERITY_PARAMETERS)
CONFIG = Path(__file__).parents[1] / "configs/ice/dhc6.toml"
UIUC_CLEAN = {  # FGDATA Aircraft-uiuc/TwinOtter/aircraft.dat
    "CX_0": -0.0488, "CX_alpha": 0.223, "CX_alpha2": 1.659, "CZ_0": -0.360, "CZ_alpha": -5.660, "CZ_q": -19.97,
    "CZ_elevator": -0.608, "Cm_0": 0.040, "Cm_alpha": -1.310, "Cm_q": -34.2, "Cm_elevator": -1.740, "CY_beta": -0.6,
    "CY_p": -0.2, "CY_r": 0.4, "CY_rudder": 0.15, "Cl_beta": -0.08, "Cl_p": -0.5, "Cl_r": 0.06, "Cl_aileron": -0.15,
    "Cl_rudder": 0.015, "Cn_beta": 0.1, "Cn_p": -0.06, "Cn_r": -0.18, "Cn_aileron": -0.001, "Cn_rudder": -0.125,
    "CD_parasite": 0.0, "alpha_stall": 0.26, "alpha_tail_stall": -0.3, "mass": 4600.0,
}  # fmt: skip
PERCENT_AT_REFERENCE = {  # AllIce at eta 0.0675, in percent
    "CX_alpha": -1.0, "CX_alpha2": -10.8, "CZ_0": 0.0, "CZ_alpha": -10.0, "CZ_q": -1.4, "CZ_elevator": -9.5,
    "Cm_0": 0.0, "Cm_alpha": -9.9, "Cm_q": -3.5, "Cm_elevator": -10.0, "CY_beta": -20.0, "CY_p": 0.0, "CY_r": 0.0,
    "CY_rudder": -8.0, "Cl_beta": -10.0, "Cl_p": -10.0, "Cl_r": 0.0, "Cl_aileron": -10.0, "Cl_rudder": -8.0,
    "Cn_beta": -20.0, "Cn_p": 0.0, "Cn_r": -6.0, "Cn_aileron": 0.0, "Cn_rudder": -8.0,
}  # fmt: skip


@kernel
def ice_all(states, parameters, current):
    for i in range(states.shape[0]):
        severity.iced_aircraft(states[i], parameters[0], current[i])


def parameters() -> np.ndarray:
    p = np.zeros(1, PARAMETERS).view(np.recarray)
    for name, entry in tomllib.loads(CONFIG.read_text())["severity"].items():
        p[name] = entry["value"]
    for name, value in UIUC_CLEAN.items():
        p[name] = value
    return p


def iced(**eta: float) -> dict[str, float]:
    states, current = np.zeros(1, STATE).view(np.recarray), np.zeros(1, CURRENT).view(np.recarray)
    for name, value in eta.items():
        states[name] = value
    ice_all(states, parameters(), current)
    return {name: float(current[name][0]) for name in CURRENT.names}


def everywhere(eta: float) -> dict[str, float]:
    return {f"eta_{surface}": eta for surface in SURFACES}


def zero_lift_drag(c: dict[str, float]) -> float:
    return -c["CX_0"] + c["CD_parasite"]


def test_configuration_has_every_parameter_and_no_other() -> None:
    entries = tomllib.loads(CONFIG.read_text())["severity"]
    assert list(entries) == [name for name, _, _ in severity.SEVERITY_PARAMETERS]
    assert {name: entries[name]["unit"] for name in entries} == {n: u for n, u, _ in severity.SEVERITY_PARAMETERS}
    assert all(entry["source"] for entry in entries.values())


def test_clean_is_bit_identical() -> None:
    c = iced()
    for name in CLEAN:
        for twin in (name, f"{name}_left", f"{name}_right"):
            if twin in c:
                assert c[twin] == UIUC_CLEAN[name], twin
    assert c["efficiency"] == 1.0


def test_reference_severity_gives_the_published_percentages() -> None:
    c = iced(**everywhere(0.0675))
    for name, percent in PERCENT_AT_REFERENCE.items():
        assert 100 * (c[name] / UIUC_CLEAN[name] - 1) == pytest.approx(percent, abs=0.06), name
    assert zero_lift_drag(c) / 0.0488 - 1 == pytest.approx(0.441, abs=0.001)


def test_wing_carries_drag_and_the_tail_hardly_any() -> None:
    base = zero_lift_drag(iced())
    wing = zero_lift_drag(iced(eta_left_wing=0.07, eta_right_wing=0.07)) - base
    tail = zero_lift_drag(iced(eta_htail=0.07)) - base
    everything = zero_lift_drag(iced(**everywhere(0.07))) - base
    assert 0.2 < wing / everything < 0.3  # paper: 0.0066 of 0.0282 by clearing the wing
    assert tail / everything < 0.05


def test_one_iced_half_wing_leaves_the_other_clean() -> None:
    c = iced(eta_left_wing=0.1)
    assert c["CZ_alpha_right"] == UIUC_CLEAN["CZ_alpha"]
    assert c["CX_0_right"] == UIUC_CLEAN["CX_0"]
    assert c["alpha_stall_right"] == UIUC_CLEAN["alpha_stall"]
    assert abs(c["CZ_alpha_left"]) < abs(UIUC_CLEAN["CZ_alpha"])
    assert c["CX_0_left"] < UIUC_CLEAN["CX_0"]
    assert c["alpha_stall_left"] < UIUC_CLEAN["alpha_stall"]
    mirrored = iced(eta_right_wing=0.1)
    assert c["CZ_alpha_left"] == mirrored["CZ_alpha_right"]
    assert c["CZ_alpha"] == mirrored["CZ_alpha"]


def test_even_ice_makes_no_asymmetry() -> None:
    c = iced(**everywhere(0.123))
    for name in ("CZ_alpha", "CX_0", "alpha_stall"):
        assert c[f"{name}_left"] == c[f"{name}_right"]
    assert c["CZ_alpha"] == c["CZ_alpha_left"]


def test_stall_shift_saturates_as_published() -> None:
    assert severity.saturated(0.08) == 0.08
    assert severity.saturated(0.1 + 1e-9) == pytest.approx(0.1, abs=1e-4)
    assert severity.saturated(10.0) == pytest.approx(0.3)


def test_tail_ice_brings_the_tail_stall_nearer_and_leaves_the_wing() -> None:
    c = iced(eta_htail=0.1)
    assert c["alpha_tail_stall"] == pytest.approx(0.75 * UIUC_CLEAN["alpha_tail_stall"])
    assert c["alpha_stall_left"] == UIUC_CLEAN["alpha_stall"]


def test_ice_mass_adds_up() -> None:
    masses = {f"ice_mass_{surface}": float(i + 1) for i, surface in enumerate(SURFACES)}
    assert iced(**masses)["mass"] == pytest.approx(4600.0 + 28.0)


@given(st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_any_severity_keeps_signs_and_bounds(etas: list[float]) -> None:
    c = iced(**{f"eta_{surface}": eta for surface, eta in zip(SURFACES, etas, strict=True)})
    assert all(np.isfinite(value) for value in c.values())
    for name in DERIVATIVE_NAMES:
        assert c[name] / UIUC_CLEAN[name] >= 0.3 - 1e-12, name
    assert zero_lift_drag(c) >= 0.0488 - 1e-12
    assert 0.3 <= c["efficiency"] <= 1.0
