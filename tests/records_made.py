"""Flight records of the tests' own small aircraft."""

from __future__ import annotations

import numpy as np

from icing_env.record import FlightRecord, Geometry, RecordMeta

LEFT_OUT = ("time", "lwc", "mvd", "torque_left", "torque_right", "rpm_left", "rpm_right", "ground_speed", "track",
            "psi", "hinge_moment_elevator", "hinge_moment_aileron", "throttle_left", "throttle_right",
            "altitude")  # fmt: skip


def record_of(measurement: np.ndarray, airframe: np.ndarray, without: tuple[str, ...] = ()) -> FlightRecord:
    """MEASUREMENT rows as a record of an aircraft with the airframe's mass, inertia and geometry."""
    one = airframe[0]
    geometry = Geometry(float(one["wing_area"]), float(one["span"]), float(one["chord"]))
    inertia = tuple(float(one[f"inertia_{n}"]) for n in ("xx", "yy", "zz", "xz"))
    meta = RecordMeta(aircraft="made", mass=float(one["mass"]), inertia=inertia, geometry=geometry, name="made")
    names = [n for n in measurement.dtype.names if n not in (*LEFT_OUT, *without)]
    channels = {"time": measurement["time"].copy(), **{n: measurement[n].copy() for n in names}}
    return FlightRecord(channels, meta)
