"""Boots and heat: one shot, cycles, residual ice, failures, perfect boots, runback, energy."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from icing_env import ice_protection
from icing_env.jit import kernel
from icing_env.types import COMMAND, STATE, SURFACES, structured

PARAMETERS = structured([*ice_protection.PROTECTION_PARAMETERS, ("eta_saturation_other", "1", "")])
CONFIG = tomllib.loads((Path(__file__).parents[1] / "configs/ice/dhc6.toml").read_text())["ice_protection"]
GROUPS = {"boots_wing": ("left_wing", "right_wing"), "boots_tail": ("htail",),
          "boots_vtail_struts": ("vtail", "struts")}  # fmt: skip


@kernel
def operate(states, parameters, commands, dt, steps):
    for _ in range(steps):
        ice_protection.advance_protection(states[0], parameters[0], commands[0], dt)
        states[0].step += 1


def setting(thickness: float = 0.008, **values: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    s, p, u = (np.zeros(1, kind).view(np.recarray) for kind in (STATE, PARAMETERS, COMMAND))
    for name, entry in CONFIG.items():
        p[name] = entry["value"]
    p["eta_saturation_other"] = 0.12
    s["temperature"] = 268.15
    for surface in SURFACES:
        s[f"eta_{surface}"], s[f"thickness_{surface}"], s[f"ice_mass_{surface}"] = 0.07, thickness, 3.0
    for name, value in values.items():
        p[name] = value
    return s, p, u


def shares(s: np.ndarray) -> dict[str, float]:
    return {surface: float(s[f"eta_{surface}"][0]) / 0.07 for surface in SURFACES}


def test_configuration_has_every_parameter_and_no_other() -> None:
    assert {name: entry["unit"] for name, entry in CONFIG.items()} == {
        name: unit for name, unit, _ in ice_protection.PROTECTION_PARAMETERS
    }


def test_nothing_commanded_nothing_changes() -> None:
    s, p, u = setting()
    operate(s, p, u, 0.02, 100)
    assert all(share == 1.0 for share in shares(s).values())
    assert s["boot_cycles"][0] == 0.0
    assert s["heat_energy"][0] == 0.0


@pytest.mark.parametrize("group", GROUPS)
def test_one_group_clears_its_surfaces_only(group: str) -> None:
    s, p, u = setting(boot_runback_share=0.0)
    u[group] = 1.0
    operate(s, p, u, 0.02, 10)
    assert s["boot_cycles"][0] == 1.0
    for surface, share in shares(s).items():
        if surface in GROUPS[group]:
            assert share < (0.7 if surface == "struts" else 0.3)
        else:
            assert share == 1.0


def test_each_rising_edge_is_one_shot() -> None:
    s, p, u = setting()
    for on in (1.0, 0.0, 1.0, 0.0):
        u["boots_wing"] = on
        operate(s, p, u, 0.02, 50)
    assert s["boot_cycles"][0] == 2.0


def test_held_on_it_cycles() -> None:
    s, p, u = setting()
    u["boots_tail"] = 1.0
    operate(s, p, u, 0.1, 5401)  # nine minutes: at 0, 180, 360, 540 s
    assert s["boot_cycles"][0] == 4.0


def test_thin_ice_stays_better_than_thick_ice() -> None:
    left = []
    for thickness in (0.0005, 0.002, 0.008):
        s, p, u = setting(thickness)
        u["boots_wing"] = 1.0
        operate(s, p, u, 0.02, 1)
        left.append(shares(s)["left_wing"])
    assert left[0] > left[1] > left[2] >= 0.25


def test_perfect_boots_leave_nothing() -> None:
    s, p, u = setting(boot_residual=0.0, boot_thin_thickness=0.0)
    u["boots_wing"] = u["boots_tail"] = u["boots_vtail_struts"] = 1.0
    operate(s, p, u, 0.02, 1)
    share = shares(s)
    assert share["left_wing"] == share["right_wing"] == share["htail"] == share["vtail"] == 0.0
    assert share["struts"] == pytest.approx(0.5)  # the rest is out of reach


def test_a_failed_boot_leaves_its_half_wing_iced() -> None:
    s, p, u = setting(boot_failed_left_wing=1.0)
    u["boots_wing"] = 1.0
    operate(s, p, u, 0.02, 1)
    assert shares(s)["left_wing"] == 1.0
    assert shares(s)["right_wing"] < 0.3


@pytest.mark.parametrize("surface", ["htail", "vtail", "struts"])
def test_other_failures(surface: str) -> None:
    s, p, u = setting(**{f"boot_failed_{surface}": 1.0})
    u["boots_tail"] = u["boots_vtail_struts"] = 1.0
    operate(s, p, u, 0.02, 1)
    assert shares(s)[surface] == 1.0


def test_runback_refreezes_below_freezing_only() -> None:
    cold, p, u = setting()
    u["boots_wing"] = 1.0
    operate(cold, p, u, 0.02, 1)
    cleared = 6.0 - cold["ice_mass_left_wing"][0] - cold["ice_mass_right_wing"][0]
    assert cold["ice_mass_other"][0] - 3.0 == pytest.approx(0.05 * cleared)
    assert shares(cold)["other"] > 1.0
    warm, p, u = setting()
    warm["temperature"], u["boots_wing"] = 274.0, 1.0
    operate(warm, p, u, 0.02, 1)
    assert shares(warm)["other"] == 1.0


def test_runback_severity_saturates() -> None:
    s, p, u = setting(boot_runback_share=1.0)
    for _ in range(200):
        s["ice_mass_left_wing"] = 3.0
        for on in (1.0, 0.0):
            u["boots_wing"] = on
            operate(s, p, u, 0.02, 1)
    assert s["eta_other"][0] <= 0.12


def test_heat_clears_the_propeller_and_counts_its_energy() -> None:
    s, p, u = setting()
    u["prop_heat"] = 1.0
    operate(s, p, u, 0.02, 1500)  # 30 s, one time constant
    assert shares(s)["propeller"] == pytest.approx(np.exp(-1.0), rel=1e-9)
    assert s["heat_energy"][0] == pytest.approx(1200.0 * 30.0)
    assert shares(s)["left_wing"] == 1.0


def test_failed_heat_does_nothing() -> None:
    s, p, u = setting(prop_heat_failed=1.0)
    u["prop_heat"] = 1.0
    operate(s, p, u, 0.02, 100)
    assert shares(s)["propeller"] == 1.0
    assert s["heat_energy"][0] == 0.0
