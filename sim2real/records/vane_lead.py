"""Vanes ahead of the aircraft, which meet a gust before its wings do: told by when the accelerations feel it.

On a nose boom x ahead of the centre of gravity a gust shows x/V earlier, while what the aircraft's own motion does to
the flow shows at once (the rest of it is corrected by rates, `estimators.compatibility.flow_angles`). What moves the
flow angles beside the motion, which gyros and accelerometers tell, is gust; the normal force lags behind that part of
alpha by the lead, and the side force behind that of beta. Where the normal force alone lags, the wings are late and the
vanes are where they should be. Least squares as in `late_power`. The flow at the centre of gravity is what the vanes
read a lead ago, and what the motion has changed since.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import detrend, lfilter, savgol_filter

from icing_env.atmosphere import G0, density
from icing_env.record import FloatArray
from sim2real.records.channels import MEASURED
from sim2real.records.instruments import lateness, table_of
from sim2real.records.late_power import CLEAR, SPAN, until_none_is_left
from sim2real.records.reconstruct import Reconstruction

SMOOTH = 0.2  # s, over which a parabola through alpha tells how it changes
LEAST, LONGEST, EDGE = 2.0, 12.0, 0.25  # m: shorter booms are left alone, longer ones are none; s
AGAIN = 3  # times that gusts are told from the motion and the motion from them
VANES = ("alpha", "beta")
NEEDED = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az")


def met_together(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records with the flow angles that the centre of gravity meets."""
    (boom, error), place = boom_of_vanes(flights), _declared(flights)
    if not (boom > CLEAR * error and LEAST < boom < LONGEST) or _late_lift(flights, boom):
        return list(flights)
    if place is not None and abs(boom - place) < 0.5 * place:  # nearer to that than to the centre of gravity
        return [_later(flight, place, ", as declared") for flight in flights]
    return [_later(flight, boom) for flight in flights]


def _declared(flights: Sequence[Reconstruction]) -> float | None:
    """How far ahead side files say that the vane of alpha is, m; None where they do not, or not all the same.

    They tell it of vanes that were corrected to the centre of gravity, too: by rates, which takes no gust back.
    """
    places = set()
    for flight in flights:
        place = table_of(flight.record.meta.sensors, "alpha").get("position")
        ahead = place[0] if isinstance(place, list | tuple) and len(place) == 3 else None
        places.add(float(ahead) if isinstance(ahead, int | float) else None)
    return places.pop() if len(places) == 1 else None


def boom_of_vanes(flights: Sequence[Reconstruction]) -> tuple[float, float]:
    """By how much vanes are ahead in the gusts, and its standard error, m; the error is infinite where nothing tells.

    Beside the lag that they are known to have, by which all that they read is late.
    """
    return until_none_is_left(flights, _normal, LONGEST)


def _late_lift(flights: Sequence[Reconstruction], boom: float) -> bool:
    """Whether it is the wings that are late, not the vanes early: beta's gusts do not lead the side force as far."""
    ahead, error = until_none_is_left(flights, _sideways, LONGEST)
    return bool(np.isfinite(error)) and ahead < 0.5 * boom


def _lead(flight: Reconstruction, boom: float) -> float:
    """By how much earlier vanes `boom` m ahead meet a gust, s."""
    return boom / float(np.median(flight.channel("airspeed")))


def _normal(flight: Reconstruction, boom: float) -> list[FloatArray]:
    """Alpha, how its gusts lessen a metre on, what lift goes with beside, the normal force [samples, columns]."""
    return _spans(flight, boom, "alpha", "az", lambda alpha: [
        alpha**2, flight.channel("q") / flight.channel("airspeed"), flight.controls["elevator"]])  # fmt: skip


def _sideways(flight: Reconstruction, boom: float) -> list[FloatArray]:
    """As `_normal`, of beta and the side force."""
    return _spans(flight, boom, "beta", "ay", lambda _: [
        *(flight.channel(rate) / flight.channel("airspeed") for rate in ("p", "r")),
        flight.controls["rudder"], flight.controls["aileron"]])  # fmt: skip


def _spans(flight: Reconstruction, boom: float, vane: str, force: str,
           beside: Callable[[FloatArray], list[FloatArray]]) -> list[FloatArray]:  # fmt: skip
    """An angle, how its gusts lessen a metre on, what goes `beside`, the force's coefficient [samples, columns]."""
    length = 2 * round(0.5 * SMOOTH / flight.dt) + 1
    if length < 5 or not all(flight.has(name) for name in NEEDED):
        return []
    late, own = lateness(float(flight.parameters["vane_lag"][0]), flight.dt), motion(flight)[VANES.index(vane)]
    angle = flight.channel(vane) - np.cumsum(own) * flight.dt
    angle = np.interp(flight.time - _lead(flight, boom) + late, flight.time, angle) + np.cumsum(own) * flight.dt
    gusty = (savgol_filter(angle, length, 2, deriv=1, delta=flight.dt) - own) * _lead(flight, 1.0)
    p, V = flight.parameters[0], flight.channel("airspeed")
    qs = 0.5 * density(float(np.median(flight.altitude))) * V**2 * float(p["wing_area"])
    felt = float(p["mass"]) * flight.channel(force) / qs
    columns = np.column_stack([angle, -gusty, *beside(angle), felt])
    edge, each = length + round(EDGE / flight.dt), round(SPAN / flight.dt)
    inside = columns[edge:-edge] - columns[edge:-edge].mean(axis=0)
    return [inside[i : i + each] for i in range(0, len(inside) - each + 1, each)]


def motion(flight: Reconstruction) -> tuple[FloatArray, FloatArray]:
    """Rates of alpha and beta in gusts that do not change, rad/s (N,), from the equations of motion in body axes.

    In air at rest they are those of Klein & Morelli (2006), eqs. 10.3 to 10.5. What turning moves from one body axis to
    another is the velocity through the air but for the gusts, which have body axes in the Dryden model, so that of them
    nothing is moved: 0.3 rad/s of roll in a side gust of 1.5 m/s at 65 m/s would make 0.6 mrad of alpha in 86 ms.
    """
    V, a, b, p, q, r, phi, theta, ax, ay, az = (flight.channel(name) for name in NEEDED)
    air = V * np.array([np.cos(a) * np.cos(b), np.sin(b), np.sin(a) * np.cos(b)])
    pull = G0 * np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    felt, rates = np.array([ax, ay, az]) + pull, np.array([p, q, r])
    gust, change = np.zeros_like(air), np.zeros_like(air)
    for _ in range(AGAIN):
        change = felt - np.cross(rates, air - gust, axis=0)
        gust = detrend(air - cumulative_trapezoid(change, dx=flight.dt, initial=0.0))
    u, v, w = air
    faster = np.sum(air * change, axis=0) / V
    return ((u * change[2] - w * change[0]) / (u**2 + w**2),
            (change[1] - v / V * faster) / np.sqrt(u**2 + w**2))


def _at_centre(flight: Reconstruction, lead: float) -> dict[str, FloatArray]:
    """Flow angles of some time ago and what the motion has changed since."""
    out = {}
    for name, own in zip(VANES, motion(flight), strict=True):
        turned = cumulative_trapezoid(own, dx=flight.dt, initial=0.0)
        turned = _behind(turned, float(flight.parameters["vane_lag"][0]), flight.dt)
        out[name] = _ago(flight.channel(name) - turned, lead / flight.dt) + turned
    return out


def _ago(values: FloatArray, samples: float) -> FloatArray:
    """Values some samples ago, as they began before.

    Between two samples by an all-pass (Thiran, IEEE Transactions on Circuit Theory 18(6), 1971): white noise stays
    white and as strong, which a mean of the two would lessen, and so does a gust, which a lag would.
    """
    whole = max(math.floor(samples - 0.5), 0)
    before = values[np.clip(np.arange(len(values)) - whole, 0, len(values) - 1)]
    a = (1.0 + whole - samples) / (1.0 - whole + samples)
    return np.asarray(values[0] + lfilter([a, 1.0], [1.0, a], before - values[0]))


def _behind(angle: FloatArray, lag: float, dt: float) -> FloatArray:
    """An angle behind a lag of first order."""
    share = -np.expm1(-dt / lag) if lag > 0.0 else 1.0
    return np.asarray(lfilter([share], [1.0, share - 1.0], angle))


def _later(flight: Reconstruction, boom: float, how: str = "") -> Reconstruction:
    """The record with flow angles at the centre of gravity, none where it had none; as it is without all of NEEDED."""
    if not all(flight.has(name) for name in NEEDED):
        return flight
    measured = flight.measured.copy()
    for name, angle in _at_centre(flight, _lead(flight, boom)).items():
        column = MEASURED.index(name)
        measured[:, column] = np.where(np.isfinite(measured[:, column]), angle, np.nan)
    return replace(flight, measured=measured, notes=(
        *flight.notes, f"vanes meet gusts {boom:.1f} m before the wings{how}: taken at the centre of gravity"))
