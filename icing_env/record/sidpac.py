"""Flight records in SIDPAC's form: the matrix `fdata` (N x 90) of a .mat file.

Columns and units are those of SIDPAC_Data_Channels.pdf (6 Nov 2005), numbered from 1 as there. A column of zeros is a
channel that was not recorded. Nothing is ever unpickled.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from icing_env.errors import InputError
from icing_env.record.flight import FlightRecord, FloatArray, Geometry, RecordMeta

FT, LBF, SLUG = 0.3048, 4.4482216152605, 14.593902937206  # m, N, kg (exact definitions of the foot and the pound)
G = 32.174 * FT  # m/s2, the value that SIDPAC's definitions use
DEG, INCH = math.pi / 180.0, 0.0254
PSF, SLUG_FT2, SLUG_FT3 = LBF / FT**2, SLUG * FT**2, SLUG / FT**3

# name: (column from 1, SI per unit of the column)
CHANNELS: dict[str, tuple[int, float]] = {
    "airspeed": (2, FT), "beta": (3, DEG), "alpha": (4, DEG), "p": (5, DEG), "q": (6, DEG), "r": (7, DEG),
    "phi": (8, DEG), "theta": (9, DEG), "psi": (10, DEG), "ax": (11, G), "ay": (12, G), "az": (13, G),
    "elevator": (14, DEG), "aileron": (15, DEG), "rudder": (16, DEG), "flap": (17, DEG), "altitude": (30, FT),
    "thrust_left": (38, LBF), "thrust_right": (39, LBF), "mass": (48, SLUG),
}  # fmt: skip
OWNER: dict[str, tuple[int, float]] = {
    "p_dot": (42, DEG), "q_dot": (43, DEG), "r_dot": (44, DEG),
    "CX": (61, 1.0), "CY": (62, 1.0), "CZ": (63, 1.0), "Cl": (64, 1.0), "Cm": (65, 1.0), "Cn": (66, 1.0),
    "p_hat": (71, 1.0), "q_hat": (72, 1.0), "r_hat": (73, 1.0), "qbar": (27, PSF), "density": (29, SLUG_FT3),
}  # fmt: skip
# Twin Otter records of NASA's SIDPAC by the first 16 hex digits of their SHA-256: test date and flight.
KNOWN = {
    "2d3aa5ed893676dc": "14 Feb 2002 #17", "2412f49e05f85d3e": "14 Feb 2002 #14", "728b83caec59cf36": "9752ed20",
    "decde17233e0cf41": "13 Feb 2002 #18", "f6375a8f96b106a2": "13 Feb 2002 #17", "3da818c3d8ec086e": "13 Feb 2002 #17",
    "09a160390b4c2995": "13 Feb 2002 #18", "e61378d1df21107e": "13 Feb 2002 #19", "bc51e84afb3289db": "low airspeed",
}  # fmt: skip


def read_mat(path: Path) -> FlightRecord:
    """Read a SIDPAC record; raises InputError where the file holds no usable `fdata`."""
    raw = path.read_bytes()
    digest = hashlib.sha256(raw).hexdigest()
    try:
        mat = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # scipy raises whatever a damaged header leads it to
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: not a MATLAB file that can be read (version 7 or older): {why}") from error
    if "fdata" not in mat:
        found = ", ".join(name for name in mat if not name.startswith("__")) or "nothing"
        raise InputError(f"{path}: no matrix 'fdata' (SIDPAC, N x 90); found: {found}")
    fdata = np.asarray(mat["fdata"])
    if fdata.ndim != 2 or fdata.shape[1] < 16 or fdata.dtype.kind not in "fiu":
        raise InputError(f"{path}: 'fdata' is {fdata.shape} of {fdata.dtype}; SIDPAC's matrix is N x 90 of numbers")
    fdata = fdata.astype(np.float64)
    notes: list[str] = []
    channels = {"time": _time(fdata, mat, path, notes), **_columns(fdata, CHANNELS)}
    if "psi" in channels:
        channels["psi"] = np.unwrap(channels["psi"])
    owner = _columns(fdata, OWNER)
    meta = _meta(fdata, mat, channels, path, digest, notes)
    if "mass" in channels and np.ptp(channels["mass"]) == 0.0:
        del channels["mass"]  # one number says it; the channel is for a mass that changes
    return FlightRecord(channels, meta, owner)


def _columns(fdata: FloatArray, names: dict[str, tuple[int, float]]) -> dict[str, FloatArray]:
    """The recorded ones of the named columns, in SI."""
    present = {n: (c, u) for n, (c, u) in names.items() if c <= fdata.shape[1] and np.nan_to_num(fdata[:, c - 1]).any()}
    return {name: fdata[:, column - 1] * unit for name, (column, unit) in present.items()}


def _time(fdata: FloatArray, mat: dict[str, Any], path: Path, notes: list[str]) -> FloatArray:
    """Column 1 where it increases, else the variable `t`, else steps of `dt`."""
    if np.all(np.diff(fdata[:, 0]) > 0):
        return fdata[:, 0]
    t = np.atleast_1d(mat.get("t", np.empty(0)))
    if t.shape == (len(fdata),) and np.all(np.diff(t) > 0):
        notes.append("time from variable t, column 1 does not increase")
        return np.asarray(t, dtype=np.float64)
    dt = _number(mat, "dt")
    if dt is not None and dt > 0:
        notes.append("time from variable dt, column 1 does not increase")
        return np.arange(len(fdata), dtype=np.float64) * np.float64(dt)
    raise InputError(f"{path}: time (column 1 of fdata, variable t) does not increase and there is no dt")


def _number(mat: dict[str, Any], name: str) -> float | None:
    """A variable of the file that is one number; None where it is absent or something else."""
    value = np.asarray(mat.get(name, ""))
    return float(value) if value.size == 1 and value.dtype.kind in "fiu" else None


def _mean(fdata: FloatArray, column: int, unit: float) -> float | None:
    """Mean of a column in SI; None where it was not recorded."""
    if column > fdata.shape[1] or not np.nan_to_num(fdata[:, column - 1]).any():
        return None
    return float(np.nanmean(fdata[:, column - 1])) * unit


def _geometry(fdata: FloatArray, mat: dict[str, Any]) -> Geometry | None:
    """Reference area, span and chord: columns 77-79, else the variables sarea, bspan and cbar."""
    found = []
    for column, name, unit in ((77, "sarea", FT**2), (78, "bspan", FT), (79, "cbar", FT)):
        value = _mean(fdata, column, unit)
        if value is None and _number(mat, name) is not None:
            value = float(mat[name]) * unit
        if value is None or not value > 0:
            return None
        found.append(value)
    return Geometry(*found)


def _meta(
    fdata: FloatArray, mat: dict[str, Any], channels: dict[str, FloatArray], path: Path, digest: str, notes: list[str]
) -> RecordMeta:
    """What the file says of the aircraft and of the flight."""
    fds = mat.get("fds")
    text = {key: str(getattr(fds, key, "") or "") for key in ("aircraft", "maneuver", "test_date")}
    notes.append(f"SHA-256 known: {KNOWN[digest[:16]]}" if digest[:16] in KNOWN else "SHA-256 not among known records")
    notes.extend(f"{name} not recorded" for name in ("thrust_left", "altitude", "mass") if name not in channels)
    corrected = "fdatao" in mat
    if corrected:
        notes.append("corrected for compatibility by its owner; stored CX, CY, CZ are of the data before that")
    mass = _mean(fdata, 48, SLUG)
    stated = np.ravel(mat["p5003"])[:1] if "p5003" in mat else np.empty(0)
    if mass is not None and stated.size and stated.dtype.kind in "fiu" and stated[0] > 0:
        other = float(stated[0]) * LBF / G
        if abs(other / mass - 1) > 0.01:
            notes.append(f"mass disagrees: column 48 says {mass:.0f} kg (used), p5003 says {other:.0f} kg")
    inertia = [_mean(fdata, column, SLUG_FT2) for column in (49, 50, 51, 52)]
    cg = [_mean(fdata, column, INCH) for column in (45, 46, 47)]
    return RecordMeta(
        aircraft=text["aircraft"],
        flight=" ".join(part for part in (text["test_date"], text["maneuver"]) if part),
        mass=mass,
        inertia=None if None in inertia[:3] else tuple(x or 0.0 for x in inertia),  # type: ignore[arg-type]
        cg=None if cg[0] is None else tuple(x or 0.0 for x in cg),  # type: ignore[arg-type]
        notes="; ".join(notes),
        geometry=_geometry(fdata, mat),
        name=path.stem,
        sha256=digest,
        corrected=corrected,
    )
