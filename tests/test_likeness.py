"""Which generic terms are another form of an effect of the library."""

from __future__ import annotations

import numpy as np
import pytest

from sim2real.library.candidates import bank
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, is_home
from sim2real.posterior.likeness import powered
from sim2real.posterior.sets import SetFit


def terms(component: str, sizes: dict[str, float]) -> UnknownFit:
    """Generic terms of these sizes, each with a standard error of 0.1."""
    rows = {term.name: term.row for term in bank().terms if term.component == component}
    return UnknownFit(component, 0.0, tuple((name, size, 0.1) for name, size in sizes.items()), 0.0,
                      {rows[name]: size for name, size in sizes.items()})


def test_what_goes_with_power_is_no_form_of_ice_on_half_a_wing() -> None:
    ice = next(f for f in bank().families if f.effect.name == "asymmetric_ice")
    torque, lift = (terms("rolling_moment", sizes) for sizes in ({"CT": 4.0, "beta": 0.8}, {"alpha": 4.0, "CT": 0.8}))
    raw = np.eye(1 + max(*torque.weights, *lift.weights, *ice.rows))
    half = Hypothesis(SetFit((ice,), weights={ice.rows[0]: 1.0}), None, 0.0, 0.0)
    assert not is_home(half, torque, 1650.0, 1035.0, raw)
    assert not is_home(half, torque, 1650.0, 1585.0, raw)
    assert is_home(half, torque, 1650.0, 1630.0, raw)  # what explains nearly all is the cause, whatever is left
    assert is_home(half, lift, 1650.0, 1035.0, raw)


@pytest.mark.parametrize(("name", "component", "so"), [
    ("asymmetric_ice", "rolling_moment", True), ("pitch_trim", "pitching_moment", True),
    ("power_pitching", "pitching_moment", False), ("asymmetric_thrust", "yawing_moment", False),
    ("lateral_cg", "rolling_moment", True), ("mass_error", "z_force", True),
    ("thrust_loss", "x_force", False), ("pitch_gyro_bias", "sensor:q", False)])  # fmt: skip
def test_what_changes_the_airframe_alone_knows_no_power(name: str, component: str, so: bool) -> None:
    course = UnknownFit(component, 0.0, (("1", 0.1, 0.1), ("alpha*CT", -1.0, 0.1)), 0.0, {})
    assert powered(name, course) is so
    assert not powered(name, UnknownFit(component, 0.0, (("1", 1.0, 0.1), ("alpha*CT", -0.2, 0.1)), 0.0, {}))
