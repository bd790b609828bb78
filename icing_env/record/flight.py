"""One type for simulated and recorded flight.

Channels carry the column names, units and signs of the flight-record interface: SI, radians, body axes x forward,
y right, z down. A sample that was not taken is nan, so that channels may run at different rates. What the owner of
a record computed (angular accelerations, coefficients) is kept beside the measurements, never mixed with them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.errors import InputError, nearest

FloatArray = NDArray[np.float64]

COLUMNS: dict[str, str] = {
    "time": "s", "airspeed": "m/s", "alpha": "rad", "beta": "rad", "p": "rad/s", "q": "rad/s", "r": "rad/s",
    "phi": "rad", "theta": "rad", "psi": "rad", "ax": "m/s2", "ay": "m/s2", "az": "m/s2",
    "mass": "kg", "cg_x": "m", "ground_speed": "m/s", "track": "rad",
    "elevator": "rad", "aileron": "rad", "rudder": "rad", "flap": "rad",
    "elevator_command": "rad", "aileron_command": "rad", "rudder_command": "rad",
    "throttle_left": "0..1", "throttle_right": "0..1", "thrust_left": "N", "thrust_right": "N",
    "torque_left": "N m", "torque_right": "N m", "rpm_left": "1/min", "rpm_right": "1/min",
    "altitude": "m", "temperature": "K", "pressure": "Pa", "lwc": "kg/m3", "mvd": "m",
    "boots_wing": "0/1", "boots_tail": "0/1", "boots_vtail_struts": "0/1", "prop_heat": "0/1",
    "hinge_moment_elevator": "N m", "hinge_moment_aileron": "N m",
}  # fmt: skip
OWNER_COLUMNS: dict[str, str] = {"p_dot": "rad/s2", "q_dot": "rad/s2", "r_dot": "rad/s2"}  # allowed in a file
OWNER: dict[str, str] = {
    **OWNER_COLUMNS,
    **dict.fromkeys(("CX", "CY", "CZ", "Cl", "Cm", "Cn", "p_hat", "q_hat", "r_hat"), "1"),
    "qbar": "Pa", "density": "kg/m3",
}  # fmt: skip
ROLES = ("diagnose", "held_out", "reference")


@dataclass(frozen=True)
class DataProblem:
    """Something wrong with one channel between two times (s); `repaired` says whether the record was mended."""

    channel: str
    kind: str
    start: float
    end: float
    repaired: bool


@dataclass(frozen=True)
class Geometry:
    """Reference area (m2), span (m) and mean chord (m) to which coefficients refer."""

    wing_area: float
    span: float
    chord: float


@dataclass(frozen=True)
class RecordMeta:
    """What is known of a record besides its channels; None where the record does not say.

    `mass` kg; `inertia` (xx, yy, zz, xz) kg m2 with xz = + integral of x z dm; `cg` (x, y, z) m. `corrected` is
    true where the record was corrected for compatibility after its owner computed CX, CY and CZ, so that those
    belong to the data before the correction.
    """

    aircraft: str = ""
    flight: str = ""
    mass: float | None = None
    inertia: tuple[float, float, float, float] | None = None
    cg: tuple[float, float, float] | None = None
    role: str = "diagnose"
    sensors: Mapping[str, Any] = field(default_factory=dict)
    notes: str = ""
    geometry: Geometry | None = None
    name: str = ""
    sha256: str = ""
    corrected: bool = False


@dataclass(frozen=True)
class FlightRecord:
    """A flight: channels of equal length N by name, nan where not sampled.

    `owner` holds what the record's owner computed (names of `OWNER`), `problems` what is known to be wrong.
    """

    channels: Mapping[str, FloatArray]
    meta: RecordMeta = RecordMeta()
    owner: Mapping[str, FloatArray] = field(default_factory=dict)
    problems: tuple[DataProblem, ...] = ()

    def __post_init__(self) -> None:
        """Check names and lengths; raises InputError."""
        if "time" not in self.channels:
            raise InputError(f"record '{self.meta.name}' has no column 'time' (s, increasing)")
        valid, n = [*COLUMNS, *OWNER], len(self.channels["time"])
        for name, values in (*self.channels.items(), *self.owner.items()):
            if name not in valid:
                raise InputError(f"record '{self.meta.name}': unknown column '{name}'; {nearest(name, valid)}")
            if len(values) != n:
                raise InputError(f"record '{self.meta.name}': column '{name}' has {len(values)} samples, time has {n}")

    def __getitem__(self, name: str) -> FloatArray:
        """Channel or owner's column by name, shape (N,); InputError where it is absent."""
        values = self.channels.get(name, self.owner.get(name))
        if values is None:
            raise InputError(f"record '{self.meta.name}' has no column '{name}' ({self._unit(name)})")
        return values

    @staticmethod
    def _unit(name: str) -> str:
        return COLUMNS.get(name) or OWNER.get(name) or nearest(name, list(COLUMNS))

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.channels["time"])

    def has(self, name: str) -> bool:
        """Whether the channel (or owner's column) is there with at least one sample."""
        values = self.channels.get(name, self.owner.get(name))
        return values is not None and bool(np.isfinite(values).any())

    @property
    def time(self) -> FloatArray:
        """Time of each sample, s, as the file states it, shape (N,)."""
        return self.channels["time"]

    @property
    def dt(self) -> float:
        """Typical interval between samples, s (the median)."""
        return float(np.median(np.diff(self.time)))

    def take(self, rows: NDArray[Any] | slice) -> FlightRecord:
        """The same record with only the given rows (slice, indices or mask)."""
        return replace(
            self,
            channels={name: values[rows] for name, values in self.channels.items()},
            owner={name: values[rows] for name, values in self.owner.items()},
        )

    def slice(self, start: float, end: float) -> FlightRecord:
        """The part from `start` to `end`, both included, in the record's own time (s)."""
        return self.take((self.time >= start) & (self.time <= end))

    def with_problems(self, problems: Iterable[DataProblem]) -> FlightRecord:
        """The same record with more problems known."""
        return replace(self, problems=(*self.problems, *problems))
