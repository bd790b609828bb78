"""A simulator of your own against a flight record: `icing diagnose flown.csv --simulator examples/own_simulator.py`.

Six degrees of freedom and linear derivatives in plain NumPy; its elevator has 70 % of the Twin Otter's power.
"""

import numpy as np

G0, THRUST_ABOVE = 9.80665, 0.3  # m/s2; m, thrust line above the c.g.
CX = {"0": -0.0488, "alpha": 0.223, "alpha2": 1.659}  # published derivatives of the Twin Otter (FlightGear, UIUC)
CZ = {"0": -0.360, "alpha": -5.660, "q": -19.97, "elevator": 0.7*-0.608}
CM = {"0": 0.040, "alpha": -1.310, "q": -34.2, "elevator": 0.7*-1.740}
CY = {"beta": -0.6, "p": -0.2, "r": 0.4, "rudder": 0.15}
CL = {"beta": -0.08, "p": -0.5, "r": 0.06, "aileron": -0.15, "rudder": 0.015}
CN = {"beta": 0.1, "p": -0.06, "r": -0.18, "aileron": -0.001, "rudder": -0.125}


def forces(x, c, k):
    """Specific forces, angular accelerations and air data at state x = (u, v, w, p, q, r, phi, theta, h)."""
    u, v, w, p, q, r = x[:6]
    speed = np.sqrt(u*u + v*v + w*w)
    alpha, beta = np.arctan2(w, u), np.arcsin(v/speed)
    a = {"0": 1.0, "alpha": alpha, "alpha2": alpha**2, "beta": beta, "q": q*k["chord"]/(2.0*speed),
         "p": p*k["span"]/(2.0*speed), "r": r*k["span"]/(2.0*speed), **c}
    force = 0.5*k["density"]*speed**2*k["wing_area"]
    cx, cz, cm, cy, cl, cn = (sum(d[n]*a[n] for n in d) for d in (CX, CZ, CM, CY, CL, CN))
    felt = np.array([cx*force + c["thrust"], cy*force, cz*force])/k["mass"]
    inertia = np.array([[k["inertia_xx"], 0.0, -k["inertia_xz"]], [0.0, k["inertia_yy"], 0.0],
                        [-k["inertia_xz"], 0.0, k["inertia_zz"]]])
    moment = force*np.array([cl*k["span"], cm*k["chord"], cn*k["span"]])
    moment[1] -= THRUST_ABOVE*c["thrust"]
    turning = np.linalg.solve(inertia, moment - np.cross(x[3:6], inertia @ x[3:6]))
    return felt, turning, (speed, alpha, beta)


def rate(x, c, k):
    """Time derivative of the state."""
    felt, turning, _ = forces(x, c, k)
    phi, theta = x[6:8]
    down = np.array([-np.sin(theta), np.sin(phi)*np.cos(theta), np.cos(phi)*np.cos(theta)])  # in body axes
    tilt = x[4]*np.sin(phi) + x[5]*np.cos(phi)
    return np.array([*(felt + G0*down - np.cross(x[3:6], x[:3])), *turning, x[3] + np.tan(theta)*tilt,
                     x[4]*np.cos(phi) - x[5]*np.sin(phi), -down @ x[:3]])


def rollout(initial_state, controls, dt, parameters):
    """Fly freely from a state under given controls (sim2real.rollout.Rollout), by Runge-Kutta."""
    s = initial_state
    a, b, v = s["alpha"], s["beta"], s["airspeed"]
    x = np.array([v*np.cos(a)*np.cos(b), v*np.sin(b), v*np.sin(a)*np.cos(b),
                  *(s[n] for n in ("p", "q", "r", "phi", "theta", "altitude"))])
    series = {n: controls[n] for n in ("elevator", "aileron", "rudder")}
    series["thrust"] = controls["thrust_left"] + controls["thrust_right"]
    out = []
    for i in range(len(series["thrust"]) - 1):
        now, then = ({n: y[j] for n, y in series.items()} for j in (i, i + 1))
        half = {n: 0.5*(now[n] + then[n]) for n in series}
        k1 = rate(x, now, parameters)
        k2 = rate(x + 0.5*dt*k1, half, parameters)
        k3 = rate(x + 0.5*dt*k2, half, parameters)
        x = x + dt/6.0*(k1 + 2.0*k2 + 2.0*k3 + rate(x + dt*k3, then, parameters))
        felt, _, air = forces(x, then, parameters)
        out.append([*air, *x[3:8], *felt, x[8]])
    names = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "altitude")
    return dict(zip(names, np.array(out).T, strict=True))


if __name__ == "__main__":
    from icing_env import scenario
    from sim2real.closing.missing_terms import missing_terms, residual_coefficients
    from sim2real.diagnosis import diagnose
    from sim2real.rollout import gap_by_channel
    from sim2real.words import sentences
    from testbed.flight import fly

    record = fly(scenario.load("clear_air", duration=52.0), seed=1, observer=False, protection=False).record
    worst = sorted(gap_by_channel(rollout, record).items(), key=lambda item: -item[1])[:4]
    print("gap, tolerances:", ", ".join(f"{channel} {value:.2f}" for channel, value in worst))
    lacking = missing_terms(residual_coefficients(rollout, record))["Cm"]
    terms = zip(lacking.terms, lacking.fit.theta, strict=True)
    print("missing in Cm:", ", ".join(f"{value:+.3f} {term}" for term, value in terms))
    print(sentences(diagnose([record], simulator=rollout))[0])
