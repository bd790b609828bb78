"""What explanations are worth before any record."""

from math import comb

import numpy as np
import pytest

from sim2real.posterior.devices import within
from sim2real.posterior.prior import P_BESIDE, P_NONE, P_UNKNOWN, set_prior, single_prior, unknown_prior


def test_a_guest_is_a_fault_of_its_host_s_device():
    assert within("elevator_gearing", ["elevator_lag"]) and within("thrust_loss", ["asymmetric_thrust"])
    assert not within("asymmetric_thrust", ["thrust_loss"]) and not within("elevator_gearing", ["aileron_lag"])
    assert within("inertia_error", ["lateral_cg"]) and not within("lateral_cg", ["inertia_error"])
    assert not within("rudder_power", ["fin_ice"]) and not within("inertia_error", ["pitch_trim"])
    assert set_prior(("elevator_gearing", "elevator_lag"), 50) < set_prior(("elevator_gearing", "aileron_lag"), 50)


def test_all_there_may_be_is_certain():
    """What is unknown beside known effects is a share of what gaps have: P_BESIDE in all, if every gap had it."""
    n, apart = 50, (("rudder_power", "fin_ice"), ("rudder_power", "fin_ice", "pitch_trim"))
    two, three = (comb(n, len(names)) * np.exp(set_prior(names, n)) for names in apart)
    known = n * np.exp(single_prior(n)) + two + three
    assert P_NONE + P_UNKNOWN + known + P_BESIDE == pytest.approx(1.0)
    assert np.exp(unknown_prior()) == pytest.approx(P_UNKNOWN)
    assert np.exp(unknown_prior(np.log(1.0 - P_NONE))) == pytest.approx(P_BESIDE)
