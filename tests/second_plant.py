"""The flight model a second time, from docs/model.md, docs/model_weather_ice.md section 8 and configs/ alone.

Plain NumPy, nothing of ours imported, so that a slip in the compiled plant cannot repeat itself. Sections are those of
docs/model.md. Functions take floats or arrays of one shape; records are namespaces with the documents' names: `x`
continuous states, `s` gusts and ice, `c` the aircraft now, `p` parameters, `u` command. SI and radians.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace as Record
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from second_discrepancy import NAMES, bent, discrepancy

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
FILES = {"aircraft": "twin_otter", "instruments": "nasa_2002", "weather": "clear", "ice": "dhc6"}
STATES = ("north", "east", "altitude", "u", "v", "w", "e0", "e1", "e2", "e3", "p", "q", "r", "elevator", "aileron",
          "rudder", "flap", "power_left", "power_right", "alpha_downwash")  # fmt: skip
SURFACES = ("left_wing", "right_wing", "htail", "vtail", "struts", "propeller", "other")
WING_AND_HTAIL = ("CX_alpha", "CX_alpha2", "CZ_0", "CZ_q", "CZ_elevator", "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator")
WING_AND_VTAIL = ("CY_beta", "CY_p", "CY_r", "CY_rudder", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
                  "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder")  # fmt: skip

RADIUS, R, G0, T0, P0, LAPSE, H11 = 6356766.0, 287.05287, 9.80665, 288.15, 101325.0, 0.0065, 11000.0
T11, POWER = T0 - LAPSE * H11, G0 / (R * LAPSE)
P11 = P0 * (T11 / T0) ** POWER


# ---- section 1: files


def read(folder: str, name: str) -> dict[str, float]:
    """Every number of one TOML file, and of the file it starts from."""
    tree = tomllib.loads((CONFIGS / folder / f"{name}.toml").read_text(encoding="utf-8"))
    numbers = read(folder, tree["base"]) if "base" in tree else {}
    for section in tree.values():
        if isinstance(section, dict):
            numbers |= {key: float(entry["value"]) for key, entry in section.items()}
    return numbers


def parameters(**files: str) -> dict[str, float]:
    """The union of one file from each folder (`aircraft="twin_otter_flight"` and so on)."""
    numbers = dict.fromkeys((*NAMES, "CD_alpha2", "density_lapse"), 0.0)
    for folder, name in (FILES | files).items():
        numbers |= read(folder, name)
    return numbers


# ---- docs/model_weather_ice.md, section 8


def saturated(eta: Any) -> Any:
    return np.where(eta <= 0.1, eta, 0.3 - 0.3297 * np.exp(-5 * eta))


def iced_aircraft(s: Record, p: Record) -> Record:
    """The aircraft of this step (section 3) from the severities and ice masses in `s`."""
    k, wing = vars(p), (s.eta_left_wing + s.eta_right_wing) / 2

    def factor(*pairs: tuple[str, Any]) -> Any:
        return np.maximum(1 + sum(k[f"k_{name}"] * eta for name, eta in pairs), p.ice_factor_floor)

    c = {name: k[name] * factor((f"{name}_wing", wing), (f"{name}_htail", s.eta_htail)) for name in WING_AND_HTAIL}
    for name in WING_AND_VTAIL:
        c[name] = k[name] * factor((f"{name}_wing", wing), (f"{name}_vtail", s.eta_vtail))
    for side, eta in (("left", s.eta_left_wing), ("right", s.eta_right_wing)):
        for name in ("CZ_alpha", "CX_0"):
            c[f"{name}_{side}"] = k[name] * factor((f"{name}_wing", eta), (f"{name}_htail", s.eta_htail))
        c[f"alpha_stall_{side}"] = p.alpha_stall - p.k_alpha_stall_wing * saturated(eta)
    c["alpha_tail_stall"] = p.alpha_tail_stall * factor(("alpha_tail_stall_htail", saturated(s.eta_htail)))
    bluff = ("vtail", "struts", "propeller", "other")
    c["CD_parasite"] = p.CD_parasite + sum(k[f"k_CD_parasite_{part}"] * vars(s)[f"eta_{part}"] for part in bluff)
    c["efficiency"] = factor(("efficiency_propeller", s.eta_propeller))
    c["mass"] = p.mass + sum(vars(s)[f"ice_mass_{surface}"] for surface in SURFACES)
    c["elapsed"] = s.step * 0.02  # of environment steps of 0.02 s
    return Record(**c)


# ---- sections 1, 4, 5


def direction_cosines(e0: Any, e1: Any, e2: Any, e3: Any) -> list[list[Any]]:
    """C with v_body = C v_local."""
    return [
        [e0**2 + e1**2 - e2**2 - e3**2, 2 * (e1 * e2 + e0 * e3), 2 * (e1 * e3 - e0 * e2)],
        [2 * (e1 * e2 - e0 * e3), e0**2 - e1**2 + e2**2 - e3**2, 2 * (e2 * e3 + e0 * e1)],
        [2 * (e1 * e3 + e0 * e2), 2 * (e2 * e3 - e0 * e1), e0**2 - e1**2 - e2**2 + e3**2],
    ]


def atmosphere(altitude: Any, p: Record) -> tuple[Any, Any, Any]:
    """Pressure, density and gravity."""
    h = RADIUS * altitude / (RADIUS + altitude)
    low = h <= H11
    temperature = np.where(low, T0 - LAPSE * h, T11)
    pressure = np.where(low, P0 * (temperature / T0) ** POWER, P11 * np.exp(-G0 * (h - H11) / (R * T11)))
    density = (p.density_factor + p.density_lapse * altitude) * pressure / (R * (temperature + p.temperature_offset))
    return pressure, density, p.gravity_sea_level * (p.earth_radius / (p.earth_radius + altitude)) ** 2


def wind_in_body_axes(x: Record, C: list[list[Any]], p: Record) -> list[Any]:
    above = x.altitude - p.wind_reference_altitude
    north, east = p.wind_north + p.wind_north_shear * above, p.wind_east + p.wind_east_shear * above
    return [row[0] * north + row[1] * east + row[2] * p.wind_down for row in C]


def clip(a: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(a, low), high)


def air_data(x: Record, C: list[list[Any]], s: Record, p: Record) -> Record:
    pressure, density, g = atmosphere(x.altitude, p)
    wx, wy, wz = wind_in_body_axes(x, C, p)
    ua, va, wa = x.u - wx - s.gust_u, x.v - wy - s.gust_v, x.w - wz - s.gust_w
    pa, qa, ra = x.p - s.gust_p, x.q - s.gust_q, x.r - s.gust_r
    plane = np.sqrt(ua**2 + wa**2)
    V = np.sqrt(plane**2 + va**2)
    Vf = np.maximum(V, 0.1524)
    alpha, beta = np.arctan2(wa, ua), np.arctan2(va, plane)
    sin_a, cos_a = wa / np.maximum(plane, 1e-9), ua / np.maximum(plane, 1e-9)
    phat, qhat, rhat = pa * p.span / (2 * Vf), qa * p.chord / (2 * Vf), ra * p.span / (2 * Vf)
    return Record(pressure=pressure, density=density, g=g, qbar=density * V**2 / 2, ua=ua, va=va, wa=wa, qa=qa, V=V,
                  Vf=Vf, alpha=alpha, beta=beta, sin_a=sin_a, cos_a=cos_a, phat=phat, qhat=qhat, rhat=rhat)  # fmt: skip


# ---- sections 6 and 7


def smootherstep(y: Any) -> Any:
    t = clip(y, 0, 1)
    return t**3 * (6 * t**2 - 15 * t + 10)


def stall(x: Record, a: Record, s: Record, c: Record, p: Record) -> Record:
    """Separated shares of the half wings and of the tailplane, and the tail's angle of attack."""
    onset_left, onset_right = (on + p.alpha_stall_flap * x.flap for on in (c.alpha_stall_left, c.alpha_stall_right))
    a_left, a_right = a.alpha - p.panel_arm * a.phat, a.alpha + p.panel_arm * a.phat
    left = smootherstep(np.maximum(a_left - onset_left, -a_left - p.alpha_stall_negative) / p.stall_width)
    right = smootherstep(np.maximum(a_right - onset_right, -a_right - p.alpha_stall_negative) / p.stall_width)
    arrival = (s.gust_w - s.gust_w_tail) / a.Vf
    alpha_tail = (a.alpha + arrival - p.downwash_slope * x.alpha_downwash - p.downwash_flap * x.flap
                  + p.tail_incidence + a.qa * p.tail_arm / a.Vf)  # fmt: skip
    tail = smootherstep((-alpha_tail - c.alpha_tail_stall) / p.tail_stall_width)
    return Record(left=left, right=right, share=(left + right) / 2, arrival=arrival, alpha_tail=alpha_tail, tail=tail)


def power(x: Record, a: Record, c: Record, p: Record) -> Record:
    per_power = c.efficiency * p.propeller_efficiency / np.sqrt(a.ua**2 + p.propeller_static_speed**2)
    left = p.thrust_factor_left * x.power_left * per_power
    right = p.thrust_factor_right * x.power_right * per_power
    ct = np.minimum((left + right) / np.maximum(a.qbar * p.wing_area, 1e-9), 1) - p.CT_reference
    return Record(left=left, right=right, both=left + right, ct=ct)


# ---- sections 8 and 9


def half_wings(a: Record, f: Record, c: Record) -> Record:
    plate = -a.sin_a / (0.283 + 0.222 * np.abs(a.sin_a))
    axial = a.alpha * (c.CX_alpha + c.CX_alpha2 * a.alpha)
    Z_left = (1 - f.left) * (c.CZ_0 + c.CZ_alpha_left * a.alpha) + f.left * plate
    Z_right = (1 - f.right) * (c.CZ_0 + c.CZ_alpha_right * a.alpha) + f.right * plate
    X_left, X_right = c.CX_0_left + (1 - f.left) * axial, c.CX_0_right + (1 - f.right) * axial
    return Record(Z_left=Z_left, Z_right=Z_right, X_left=X_left, X_right=X_right)


def longitudinal(x: Record, a: Record, f: Record, h: Record, ct: Any, c: Record, p: Record) -> tuple[Any, Any, Any]:
    """CX, CZ, Cm."""
    low, Z_wing = p.span**2 / (p.span**2 + (16 * (x.altitude - p.ground_altitude)) ** 2), (h.Z_left + h.Z_right) / 2
    flap_lift = (1 - f.share) * p.CL_flap * x.flap
    flap_drag = p.CD_flap * x.flap + p.induced_drag * flap_lift * (flap_lift - 2 * Z_wing)
    CX = (h.X_left + h.X_right) / 2 + flap_lift * a.sin_a - flap_drag * a.cos_a + low * p.induced_drag * Z_wing**2
    CZ = (Z_wing - flap_lift * a.cos_a - flap_drag * a.sin_a
          + c.CZ_q * a.qhat + c.CZ_elevator * x.elevator + p.CZ_CT * ct + low * p.ground_lift * Z_wing)  # fmt: skip
    Cm = (c.Cm_0 + c.Cm_alpha * ((1 - f.share) * a.alpha + f.share * p.Cm_alpha_separated * a.sin_a)
          + (c.Cm_q - p.Cm_alphadot) * a.qhat + p.Cm_alpha_tail * f.arrival
          + p.Cm_alphadot * (p.chord / (2 * p.tail_arm)) * (a.alpha - x.alpha_downwash)
          + c.Cm_elevator * x.elevator * (1 + p.Cm_elevator_CT * ct) * (1 - p.tail_stall_elevator_loss * f.tail)
          + p.Cm_flap * x.flap + p.Cm_CT * ct + low * p.ground_moment
          - f.tail * p.Cm_alpha_tail * (f.alpha_tail + c.alpha_tail_stall))  # fmt: skip
    return CX, CZ, Cm


def lateral(x: Record, a: Record, f: Record, h: Record, c: Record, p: Record) -> tuple[Any, Any, Any]:
    """CY, Cl, Cn."""
    loss = 1 - p.damping_separated * f.share
    CY = p.CY_0 + c.CY_beta * a.beta + c.CY_p * a.phat + c.CY_r * a.rhat + c.CY_rudder * x.rudder
    Cl = (p.Cl_0 + p.Cl_alpha * a.alpha + c.Cl_beta * a.beta + c.Cl_r * a.rhat + c.Cl_rudder * x.rudder
          + loss * (c.Cl_p * a.phat + c.Cl_aileron * x.aileron) + p.lift_arm * (h.Z_right - h.Z_left) / 2)  # fmt: skip
    Cn = (p.Cn_0 + c.Cn_beta * a.beta + c.Cn_p * a.phat + c.Cn_r * a.rhat + c.Cn_aileron * x.aileron
          + c.Cn_rudder * x.rudder - p.lift_arm * (h.X_right - h.X_left) / 2)  # fmt: skip
    return CY, Cl, Cn


# ---- sections 10 to 13


def loads(x: Record, a: Record, f: Record, t: Record, c: Record, p: Record) -> tuple[Any, ...]:
    """Force Fx, Fy, Fz and moment L, M, N about the c.g., thrust included."""
    h = half_wings(a, f, c)
    CX, CZ, Cm = longitudinal(x, a, f, h, t.ct, c, p)
    CY, Cl, Cn = lateral(x, a, f, h, c, p)
    drag = c.CD_parasite + p.CD_alpha2 * np.sin(a.alpha) ** 2
    qS, bluff = a.qbar * p.wing_area, a.density * a.V * p.wing_area * drag / 2
    more = discrepancy(x, a, t.ct, qS * CY - bluff * a.va, c, p)
    CX, CY, CZ, Cl, Cm, Cn = (C + more[n] for n, C in zip(more, (CX, CY, CZ, Cl, Cm, Cn), strict=True))
    Fx, Fy, Fz = qS * CX - bluff * a.ua + t.both, qS * CY - bluff * a.va, qS * CZ - bluff * a.wa
    dx, dy, dz = p.cg_shift_x, p.cg_shift_y, p.cg_shift_z
    L = qS * p.span * Cl - dy * Fz + dz * Fy
    M = qS * p.chord * Cm - dz * Fx + dx * Fz + p.engine_arm_z * t.both
    N = qS * p.span * Cn - dx * Fy + dy * Fx + p.engine_arm_y * (t.left - t.right)
    return Fx, Fy, Fz, L, M, N


def rigid_body(x: Record, C: list[list[Any]], g: Any, load: tuple[Any, ...], c: Record, p: Record) -> list[Any]:
    """Rates of north to r, in the order of STATES."""
    (Fx, Fy, Fz, L, M, N), m = load, c.mass
    Ixx, Iyy, Izz, Ixz = p.inertia_xx, p.inertia_yy, p.inertia_zz, p.inertia_xz
    north, east, down = (C[0][j] * x.u + C[1][j] * x.v + C[2][j] * x.w for j in range(3))
    rolling = L + Ixz * x.p * x.q + (Iyy - Izz) * x.q * x.r
    yawing = N - Ixz * x.q * x.r + (Ixx - Iyy) * x.p * x.q
    D = Ixx * Izz - Ixz**2
    return [
        north, east, -down,
        x.r * x.v - x.q * x.w + C[0][2] * g + Fx / m,
        x.p * x.w - x.r * x.u + C[1][2] * g + Fy / m,
        x.q * x.u - x.p * x.v + C[2][2] * g + Fz / m,
        -(x.e1 * x.p + x.e2 * x.q + x.e3 * x.r) / 2, (x.e0 * x.p + x.e2 * x.r - x.e3 * x.q) / 2,
        (x.e0 * x.q + x.e3 * x.p - x.e1 * x.r) / 2, (x.e0 * x.r + x.e1 * x.q - x.e2 * x.p) / 2,
        (Izz * rolling + Ixz * yawing) / D, (M + (Izz - Ixx) * x.p * x.r - Ixz * (x.p**2 - x.r**2)) / Iyy,
        (Ixx * yawing + Ixz * rolling) / D,
    ]  # fmt: skip


def slew(position: Any, target: Any, low: Any, high: Any, lag: Any, limit: Any) -> Any:
    return clip((clip(target, low, high) - position) / lag, -limit, limit)


def floated(moment: Any, hold: Any, stiffness: Any) -> Any:
    return (moment - clip(moment, -hold, hold)) / stiffness


def actuators(x: Record, a: Record, f: Record, p: Record, u: Record) -> list[Any]:
    """Rates of elevator to power_right, in the order of STATES."""
    on_elevator = (p.hinge_elevator_delta * x.elevator + p.hinge_elevator_alpha * f.alpha_tail
                   + p.hinge_elevator_stall * f.tail) * a.qbar * p.hinge_elevator_volume  # fmt: skip
    on_aileron = p.hinge_aileron_delta * x.aileron + p.hinge_aileron_stall * (f.left - f.right)
    on_aileron *= a.qbar * p.hinge_aileron_volume
    elevator = (bent("elevator", p.elevator_gearing * u.elevator + p.elevator_offset, x, a, p)
                + floated(on_elevator, p.hinge_elevator_hold, p.hinge_elevator_stiffness))  # fmt: skip
    aileron = (bent("aileron", p.aileron_gearing * u.aileron + p.aileron_offset, x, a, p)
               + floated(on_aileron, p.hinge_aileron_hold, p.hinge_aileron_stiffness))  # fmt: skip
    rudder = bent("rudder", p.rudder_gearing * u.rudder + p.rudder_offset, x, a, p)
    loss = 1 - a.pressure / P0
    full = p.power_rated * (1 - loss * (p.power_lapse + p.power_lapse2 * loss))
    return [
        slew(x.elevator, elevator, p.elevator_min, p.elevator_max, p.elevator_lag, p.elevator_rate),
        slew(x.aileron, aileron, p.aileron_min, p.aileron_max, p.aileron_lag, p.aileron_rate),
        slew(x.rudder, rudder, p.rudder_min, p.rudder_max, p.rudder_lag, p.rudder_rate),
        slew(x.flap, u.flap, 0, p.flap_max, 0.2, p.flap_rate),
        *((full * clip(lever, 0, 1) - now) / p.spool_time
          for lever, now in ((u.throttle_left, x.power_left), (u.throttle_right, x.power_right))),
    ]


def rates(x: Record, s: Record, c: Record, p: Record, u: Record) -> list[Any]:
    """Rates of all continuous states, in the order of STATES."""
    C = direction_cosines(x.e0, x.e1, x.e2, x.e3)
    a = air_data(x, C, s, p)
    f, t = stall(x, a, s, c, p), power(x, a, c, p)
    return [*rigid_body(x, C, a.g, loads(x, a, f, t, c, p), c, p), *actuators(x, a, f, p, u),
            (a.alpha - x.alpha_downwash) * a.Vf / p.tail_arm]  # fmt: skip


# ---- section 14, with an integrator of its own


def fly(y: NDArray, seconds: float, before: Record, after: Record, c: Record, p: Record, u: Record) -> NDArray:
    """States (20 floats) after an interval with gusts on their way from `before` to `after`; the rest is held."""

    def slope(t: float, now: NDArray) -> list[Any]:
        gusts = {k: v + t/seconds*(getattr(after, k) - v) for k, v in vars(before).items() if k.startswith("gust_")}
        return rates(Record(**dict(zip(STATES, now.tolist(), strict=True))), Record(**gusts), c, p, u)

    scale = 1e-11 * np.array([1e3, 1e3, 1e3, 50, 50, 50, *[1] * 4, *[0.1] * 3, *[0.1] * 4, 1e5, 1e5, 0.1])
    solution = solve_ivp(slope, (0, seconds), y, "DOP853", rtol=1e-11, atol=scale, first_step=seconds)
    assert solution.success, solution.message
    y = solution.y[:, -1]
    y[6:10] /= np.sqrt(np.sum(y[6:10] ** 2))
    return y
