"""JSBSim's DHC-6 with a change in it: a temporary copy of the aircraft's files, edited where the change enters.

Nothing of JSBSim is kept here. Its aircraft come with the package `jsbsim`; another set is named by JSBSIM_ROOT.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

AIRCRAFT = "DHC6"
AERO = "aero/coefficient/"
INCH, LB = 0.0254, 0.45359237
QUIET = "JSBSIM_DEBUG"  # JSBSim prints a banner to standard output unless this variable is 0
Edit = Callable[[Path], None]


def data_root(named: str | None = None) -> Path | None:
    """A JSBSim tree with `aircraft/DHC6`: `named`, else JSBSIM_ROOT, else the package's own; None if it is absent."""
    if find_spec("jsbsim") is None:
        return None
    wanted = named or os.environ.get("JSBSIM_ROOT")
    if wanted:
        root = Path(wanted)
    else:
        os.environ.setdefault(QUIET, "0")
        import jsbsim

        root = Path(jsbsim.get_default_root_dir())
    return root if (root / "aircraft" / AIRCRAFT / f"{AIRCRAFT}.xml").is_file() else None


@contextmanager
def edited(root: Path, edits: Sequence[Edit] = ()) -> Iterator[Path]:
    """A temporary `aircraft` folder with the DHC-6 of `root`, `edits` made in it."""
    with tempfile.TemporaryDirectory(prefix="dhc6_") as folder:
        copy = Path(folder) / "aircraft" / AIRCRAFT
        shutil.copytree(root / "aircraft" / AIRCRAFT, copy)
        for edit in edits:
            edit(copy)
        yield copy.parent


def _changed(path: Path, change: Callable[[ET.Element], None]) -> None:
    tree = ET.parse(path)
    change(tree.getroot())
    tree.write(path, xml_declaration=True, encoding="utf-8")


def _aircraft(change: Callable[[ET.Element], None]) -> Edit:
    return lambda folder: _changed(folder / f"{AIRCRAFT}.xml", change)


def coefficient(root: ET.Element, name: str) -> ET.Element:
    """The aerodynamic function `name`, such as CLde.

    Raises:
        KeyError: this version of the aircraft has none.
    """
    for function in root.iter("function"):
        if function.get("name") == AERO + name:
            return function
    raise KeyError(name)


def scaled(factors: Mapping[str, float]) -> Edit:
    """Aerodynamic functions, each times its factor."""

    def change(root: ET.Element) -> None:
        for name, factor in factors.items():
            product = coefficient(root, name).find("product")
            assert product is not None
            ET.SubElement(product, "value").text = repr(factor)

    return _aircraft(change)


def steeper(name: str, factor: float) -> Edit:
    """A table over angle of attack: its departures from the value at zero, times `factor`."""

    def change(root: ET.Element) -> None:
        data = next(coefficient(root, name).iter("tableData"))
        rows = [[float(x) for x in line.split()] for line in (data.text or "").splitlines() if line.strip()]
        zero = next(value for angle, value in rows if angle == 0.0)
        data.text = "\n" + "\n".join(f"{a:.6f} {zero + factor * (v - zero):.8f}" for a, v in rows) + "\n"

    return _aircraft(change)


def odd_dihedral(folder: Path) -> None:
    """Rolling moment with sideslip made odd: the file has the same sign on both sides, which no aircraft has.

    The mean size of both sides, with the sign of the stable one: negative beyond positive sideslip.
    """

    def change(root: ET.Element) -> None:
        data = next(coefficient(root, "Clb").iter("tableData"))
        head, *lines = [line for line in (data.text or "").splitlines() if line.strip()]
        rows = {float(line.split()[0]): [float(x) for x in line.split()[1:]] for line in lines}
        out = [head]
        for beta, values in rows.items():
            sign = (beta < 0.0) - (beta > 0.0)
            mean = [0.5 * sign * (abs(a) + abs(b)) for a, b in zip(values, rows[-beta], strict=True)]
            out.append(f"{beta:.4f} " + " ".join(f"{v:.5f}" for v in mean))
        data.text = "\n" + "\n".join(out) + "\n"

    _aircraft(change)(folder)


_LENGTH = {"PITCH": "metrics/cbarw-ft", "ROLL": "metrics/bw-ft", "YAW": "metrics/bw-ft"}


def added(axis: str, value: float) -> Edit:
    """A constant coefficient on an axis (DRAG, SIDE, LIFT, ROLL, PITCH, YAW), in JSBSim's sign."""

    def change(root: ET.Element) -> None:
        place = next(a for a in root.iter("axis") if a.get("name") == axis)
        product = ET.SubElement(ET.SubElement(place, "function", name=f"{AERO}added_{axis.lower()}"), "product")
        for name in ("aero/qbar-psf", "metrics/Sw-sqft", *filter(None, [_LENGTH.get(axis)])):
            ET.SubElement(product, "property").text = name
        ET.SubElement(product, "value").text = repr(value)

    return _aircraft(change)


def loaded(factor: float = 1.0, forward: float = 0.0, right: float = 0.0, inertia_xx: float = 1.0) -> Edit:
    """All masses times `factor`, moved by metres forward and right; inertia_xx of the empty aircraft by its factor.

    The inertia stated in the file is that of the empty aircraft and stays, as the library's mass error leaves it.
    """

    def change(root: ET.Element) -> None:
        balance = root.find("mass_balance")
        assert balance is not None
        for weight in [*balance.iter("emptywt"), *balance.iter("weight"), *root.iter("contents")]:
            weight.text = repr(float(weight.text or 0.0) * factor)
        for place in [*balance.iter("location"), *(x for t in root.iter("tank") for x in t.iter("location"))]:
            for axis, shift in (("x", -forward / INCH), ("y", right / INCH)):
                at = place.find(axis)
                assert at is not None
                at.text = repr(float(at.text or 0.0) + shift)
        ixx = balance.find("ixx")
        assert ixx is not None
        ixx.text = repr(float(ixx.text or 0.0) * inertia_xx)

    return _aircraft(change)


def thrust(factor: float) -> Edit:
    """Thrust of the propellers at the same power."""

    def change(root: ET.Element) -> None:
        place = root.find("ct_factor")
        assert place is not None
        place.text = repr(float(place.text or 1.0) * factor)

    return lambda folder: _changed(folder / "Engines" / "Propeller.xml", change)


def gearing(component: str, factor: float) -> Edit:
    """A surface's range behind its lever, as JSBSim scales it: "Elevator Control", "Rudder Control"."""

    def change(root: ET.Element) -> None:
        scale = next(s for s in root.iter("aerosurface_scale") if s.get("name") == component)
        for end in scale.iter("range"):
            for bound in end:
                bound.text = repr(float(bound.text or 0.0) * factor)

    return lambda folder: _changed(folder / "Systems" / "Conventional Controls.xml", change)
