"""What the crew is told: nothing in clear air, the most urgent first, every advisory in words."""

from __future__ import annotations

import numpy as np
import pytest

from controllers import ice_management
from controllers.ice_management import crew
from icing_env.types import SENSED_PARTS


def row(**values):
    a = ice_management.init(1)
    for name, value in values.items():
        a[name] = value
    return a[0]


def test_clear_air_is_silent():
    assert crew.messages(row()) == []


@pytest.mark.parametrize(("said", "level", "word"), [
    ({"tail_stall": 1}, "warning", "TAIL STALL"),
    ({"roll_upset": 1}, "warning", "ROLL UPSET"),
    ({"power_lacking": 1}, "caution", "POWER LACKING"),
    ({"ice_detected": 1, "severity": 0.1}, "advisory", "ICE LIGHT"),
    ({"ice_detected": 1, "severity": 0.4}, "caution", "ICE MODERATE"),
    ({"ice_detected": 1, "severity": 0.8}, "warning", "LEAVE ICING"),
    ({"ice_detected": 1, "severity_left_wing": 0.15}, "caution", "MORE ON LEFT"),
    ({"ice_detected": 1, "severity_right_wing": 0.15}, "caution", "MORE ON RIGHT"),
    ({"ice_detected": 1, "severity_htail": 0.1}, "caution", "LIMIT FLAPS"),
    ({"intervention": 0.05}, "caution", "PROTECTION ACTIVE"),
    ({"boots_wing": 1, "boots_tail": 1}, "advisory", "WING, TAIL BOOTS"),
    ({"prop_heat": 1}, "advisory", "HEAT ON"),
    ({"adaptation": 1, "adaptation_frozen": 1, "ice_detected": 1}, "advisory", "ADAPTATION HELD"),
])
def test_each_advisory_has_words_of_its_level(said, level, word):
    told = [m for m in crew.messages(row(**said)) if word in m.text]
    assert [m.level for m in told] == [level]


@pytest.mark.parametrize("part", SENSED_PARTS)
def test_every_failed_part_is_named(part):
    (message,) = crew.messages(row(**{f"failed_{part}": 1}))
    assert message.level == "caution" and crew.PARTS[part] in message.text


def test_the_most_urgent_comes_first():
    said = crew.messages(row(ice_detected=1, severity=0.4, prop_heat=1, tail_stall=1))
    ranks = [crew.LEVELS.index(m.level) for m in said]
    assert ranks == sorted(ranks) and ranks[0] == 0 and ranks[-1] == 2


def test_the_log_tells_each_thing_when_it_begins():
    a = ice_management.init(200)
    a["ice_detected"][50:] = 1
    a["severity"][50:] = 0.1
    a["airspeed_limit"][50:] = np.linspace(45, 50, 150)  # a moving number is no news
    a["power_lacking"][120:] = 1
    told = crew.log(np.arange(200.0), a)
    assert [(t, m.level) for t, m in told if m.level == "caution"] == [(120.0, "caution")]
    assert sum("MINIMUM SPEED" in m.text for _, m in told) == 1 and told[0][0] == 50.0
