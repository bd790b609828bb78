"""The flight display: every reading is seen, nothing makes it fail, and what is not known is never shown as normal."""

from __future__ import annotations

import dataclasses
import importlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from icing_env import types
from icing_env.display import INSTRUMENTS, DisplayView, climb_rate, draw
from icing_env.display.attitude import GROUND, HAZE, SKY
from icing_env.display.panels import envelope_cue
from icing_env.display.pen import AMBER, GREEN, PAGE, RED, Pen, mix
from icing_env.display.window import Window
from icing_env.errors import InputError

SMALL = (320, 240)
FLYING = DisplayView(
    time=62.0, airspeed=70.0, altitude=1800.0, phi=0.1, theta=0.05, psi=1.0, alpha=0.06, throttle_left=0.5,
    throttle_right=0.5, severity=0.5, confidence=0.5, CL_alpha_ratio=0.8, Cm_alpha_ratio=0.8, excess_drag=0.01,
    excitation=0.5, airspeed_limit=60.0, airspeed_selected=72.0, altitude_selected=1810.0, heading_selected=1.2,
)  # fmt: skip
# A change of each reading that a pilot has to be able to see.
CHANGES = {
    "time": 5.0, "airspeed": 4.0, "altitude": 30.0, "vertical_speed": 2.0, "phi": 0.2, "theta": 0.1, "psi": 0.1,
    "alpha": 0.04, "beta": 0.08, "load_factor": 0.3, "throttle_left": 0.3, "throttle_right": 0.3, "elevator": 0.1,
    "aileron": 0.1, "rudder": 0.1, "flap": 0.2, "severity": 0.4, "confidence": 0.3, "ice_detected": 1.0,
    "boots_wing": 1.0, "boots_tail": 1.0, "boots_vtail_struts": 1.0, "prop_heat": 1.0, "alpha_limit": -0.04,
    "airspeed_limit": -10.0, "bank_limit": -0.3, "intervention": 0.02, "CL_alpha_ratio": 0.15, "Cm_alpha_ratio": 0.15,
    "excess_drag": 0.02, "excitation": 0.3, "health": -1.0, "alpha_stall_clean": 0.05, "stall_margin": -0.1,
    "airspeed_selected": 4.0, "altitude_selected": 60.0, "heading_selected": 0.2,
}  # fmt: skip


@pytest.mark.parametrize("size", [(960, 720), (640, 480), (800, 800), (1001, 333)])
def test_frame_has_the_size_asked_for(size: tuple[int, int]) -> None:
    frame = draw(FLYING, size)
    assert frame.shape == (size[1], size[0], 3)
    assert frame.dtype == np.uint8


def test_same_view_same_frame() -> None:
    assert np.array_equal(draw(FLYING, SMALL), draw(dataclasses.replace(FLYING), SMALL))


def test_every_reading_is_covered() -> None:
    assert set(CHANGES) == {field.name for field in dataclasses.fields(DisplayView)}


@pytest.mark.parametrize("name", sorted(CHANGES))
def test_every_reading_is_seen(name: str) -> None:
    changed = dataclasses.replace(FLYING, **{name: getattr(FLYING, name) + CHANGES[name]})
    different = np.any(draw(FLYING, SMALL) != draw(changed, SMALL), axis=2)
    assert different.sum() >= 4


ANGLE = st.floats(-20.0, 20.0)
ANY = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=60)
@given(phi=ANGLE, theta=st.floats(-math.pi / 2, math.pi / 2), psi=ANGLE, alpha=ANGLE, beta=ANGLE)
def test_every_attitude_draws(phi: float, theta: float, psi: float, alpha: float, beta: float) -> None:
    view = dataclasses.replace(FLYING, phi=phi, theta=theta, psi=psi, alpha=alpha, beta=beta)
    assert draw(view, SMALL).any()


@settings(max_examples=60)
@given(data=st.data())
def test_any_float_in_any_reading_draws(data: st.DataObject) -> None:
    names = data.draw(st.lists(st.sampled_from(sorted(CHANGES)), min_size=1, max_size=6, unique=True))
    view = dataclasses.replace(FLYING, **{name: data.draw(ANY) for name in names})
    assert draw(view, SMALL).any()


@pytest.mark.parametrize(("instrument", "box", "name", "needs"), INSTRUMENTS, ids=[row[2] for row in INSTRUMENTS])
def test_failed_reading_is_crossed_out(instrument: object, box: tuple, name: str, needs: tuple[str, ...]) -> None:
    frame = draw(dataclasses.replace(FLYING, **{needs[0]: math.nan}), PAGE)
    left, top, right, bottom = (int(edge) for edge in box)
    near = np.abs(frame[top:bottom, left:right].astype(int) - RED).max(axis=2) < 30
    assert near.sum() > 0.5 * math.hypot(right - left, bottom - top)


def share_of(frame: np.ndarray, base: tuple[int, int, int], haze: tuple[int, int, int]) -> np.ndarray:
    """Pixels of the attitude indicator in any shade between the two colours."""
    inner = frame[80:440, 140:500].astype(int)
    shades = [mix(base, haze, 0.026 * step) for step in range(11)]
    found = np.any([np.abs(inner - shade).max(axis=2) <= 3 for shade in shades], axis=0)
    row, column = np.indices(found.shape) - 180
    return found & (np.hypot(row, column) < 170.0)


@pytest.mark.parametrize("phi", [0.0, 0.6, -0.6, math.pi])
def test_sky_is_above_and_tilts_against_the_bank(phi: float) -> None:
    frame = draw(dataclasses.replace(FLYING, phi=phi, theta=0.0))
    sky, ground = share_of(frame, SKY, (238, 242, 247)), share_of(frame, GROUND, HAZE)
    rows, columns = np.subtract(*(np.argwhere(part).mean(axis=0) for part in (sky, ground)))
    # From ground to sky points up the sky: on the screen (-sin phi, -cos phi), x right and y down.
    assert abs(math.remainder(math.atan2(-columns, -rows) - phi, 2.0 * math.pi)) < 0.05


def test_nose_up_shows_more_sky() -> None:
    up, down = (share_of(draw(dataclasses.replace(FLYING, theta=t)), SKY, (238, 242, 247)).sum() for t in (0.15, -0.15))
    assert up > 2 * down


def test_envelope_cue() -> None:
    assert envelope_cue(FLYING) == ("ENVELOPE NORMAL", GREEN, False)
    assert "ALPHA PROT" in envelope_cue(dataclasses.replace(FLYING, intervention=-0.01))[0]
    text, colour, _ = envelope_cue(dataclasses.replace(FLYING, airspeed=30.0, phi=-1.2))
    assert (text, colour) == ("BEYOND LIMIT:  SPEED  BANK", AMBER)
    assert envelope_cue(dataclasses.replace(FLYING, alpha=0.5))[1:] == (RED, True)
    assert envelope_cue(dataclasses.replace(FLYING, alpha=math.nan))[0] == "ENVELOPE UNKNOWN"


def test_climb_rate() -> None:
    # Wings level, flight path = theta - alpha; a knife edge turns the sideslip into climb.
    assert climb_rate(70.0, 0.05, 0.0, 0.0, 0.15) == pytest.approx(70.0 * math.sin(0.10))
    assert climb_rate(70.0, 0.0, -0.1, math.pi / 2, 0.0) == pytest.approx(70.0 * math.sin(0.1))


def test_view_from_rows() -> None:
    measurement, advisory, estimate = (np.zeros(1, t) for t in (types.MEASUREMENT, types.ADVISORY, types.ESTIMATE))
    measurement["airspeed"], measurement["az"], measurement["theta"] = 70.0, -19.6133, 0.1
    advisory["alpha_limit"], advisory["severity"] = 0.2, 0.3
    estimate["CL_alpha"], estimate["Cm_alpha"], estimate["health"] = 4.5, -1.0, 1.0
    view = DisplayView.from_rows(measurement[0], advisory[0], estimate[0], (5.0, -2.0), 0.26)
    assert (view.CL_alpha_ratio, view.Cm_alpha_ratio) == (0.9, 0.5)
    assert view.load_factor == pytest.approx(2.0)
    assert view.vertical_speed == pytest.approx(70.0 * math.sin(0.1))
    assert (view.alpha_limit, view.severity, view.alpha_stall_clean) == (0.2, 0.3, 0.26)


@pytest.mark.parametrize("size", [(0, 0), (100, 720), (9000, 720)])
def test_bad_size_is_one_line(size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match=r"240\.\.4096") as raised:
        draw(FLYING, size)
    assert "\n" not in str(raised.value)


def test_text_stays_where_it_was_put() -> None:
    image = Image.new("RGB", (200, 40))
    Pen(image, 1.0).text((100.0, 20.0), "ICE", 16.0)
    columns = np.argwhere(np.asarray(image).any(axis=(0, 2)))
    assert columns.mean() == pytest.approx(100.0, abs=2.0)


def test_window_shows_frames_without_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame", reason="pygame is not installed")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Window()
    frame = draw(FLYING, SMALL)
    assert window.show(frame)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    assert np.array_equal(shown, frame)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert not window.show(frame)
    window.close()
    window.close()


def test_window_without_pygame_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(InputError, match="render"):
        Window()
