"""Every method on every recorded flight, against what the textbook printed for the technique it belongs to.

Klein & Morelli, Aircraft System Identification (AIAA 2006): examples 5.1 (equation error), 6.1 (output error) and 7.1
(both in the frequency domain) on the lateral record, SIDPAC's demonstration on the longitudinal one. The third record
has no printed results; it is predicted from another (prediction.py).
"""

from __future__ import annotations

from functools import lru_cache

from estimators.estimate import Estimate
from estimators.likelihood import output_error
from estimators.methods import METHODS, method
from icing_env.record import FlightRecord, read
from testbed.reports.identification_figures import methods_compared
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row, Rule
from testbed.textbook import BOOK, folder

ITEM = "recorded_methods"
CLOSE = Rule(relative=0.05)
LIKELY = Rule(relative=0.03)  # output error: 3 % or one corrected standard error
LATERAL, LONGITUDINAL = "totter_f1_017_data.mat", "totter_demo_data.mat"
NAMES = {LATERAL: ("CY_beta", "CY_r", "CY_rudder", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder", "Cn_beta",
                   "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder"),
         LONGITUDINAL: ("CZ_alpha", "CZ_q", "CZ_elevator", "Cm_alpha", "Cm_q", "Cm_elevator")}  # fmt: skip
# Values in the order of NAMES; None where nothing is printed.
PRINTED: dict[str, dict[str, tuple[float | None, ...]]] = {
    "equation error": {name: tuple(float(v) for v in BOOK[name].values()) for name in NAMES},
    "output error": {
        LATERAL: (-0.8646, 0.9331, 0.3800, -0.1196, -0.5859, 0.1889, -0.2282, 0.0422, 0.08638, -0.06441, -0.19059,
                  -0.00298, -0.13548),
        LONGITUDINAL: (-6.760, None, -0.409, -1.543, -33.25, -1.835)},
    "frequency, equation error": {
        LATERAL: (-0.8456, 0.9546, 0.3366, -0.1138, -0.5716, 0.1792, -0.2270, 0.0259, 0.08505, -0.05524, -0.20048,
                  0.00040, -0.13190)},
    "frequency, output error": {
        LATERAL: (-0.8608, 0.8888, 0.3417, -0.1198, -0.5928, 0.1738, -0.2330, 0.0261, 0.08547, -0.06610, -0.19329,
                  -0.00364, -0.13737)},
}  # fmt: skip
# The technique whose printed results a method is held against; equation error for those not named.
TECHNIQUE = {"output_error": "output error", "filter_error": "output error",
             "real_time_frequency": "frequency, equation error",
             "frequency_domain": "frequency, output error"}  # fmt: skip
TEXTBOOK_MODEL = "output_error, textbook's model"
WHY = {"equation error": "the book regresses on the smoothed columns that the record's owner stored",
       "output error": "the book's model has no CZ_q, no CY_p and no errors of the instruments but biases"}


def rows(seed: int) -> list[Row]:
    """Each derivative that the textbook prints, by every method that gives it."""
    del seed
    found = []
    for name, record in records().items():
        for how, estimates in identified(name).items():
            technique = TECHNIQUE.get(how, TECHNIQUE["output_error"] if how == TEXTBOOK_MODEL else "equation error")
            technique = printed_by(technique, name)
            book = printed(technique, name)
            found += [_row(record, how, technique, key, value, estimates) for key, value in book.items()
                      if key in estimates]
    return found


def records() -> dict[str, FlightRecord]:
    """The recorded flights with printed results that are present, by file name."""
    return {name: read(folder()/name) for name in NAMES if (folder()/name).is_file()}


def printed_by(technique: str, name: str) -> str:
    """The technique, or the same in the time domain where the textbook prints nothing of the record in frequency."""
    return technique if name in PRINTED[technique] else technique.removeprefix("frequency, ")


def printed(technique: str, name: str) -> dict[str, float]:
    """What the textbook prints of a record by a technique."""
    values = PRINTED[printed_by(technique, name)][name]
    return {key: value for key, value in zip(NAMES[name], values, strict=True) if value is not None}


@lru_cache(maxsize=2)
def identified(name: str) -> dict[str, dict[str, Estimate]]:
    """Estimates of every registered method on a record, and of output error with the textbook's model."""
    record = records()[name]
    found = {how: method(how)(record) for how in METHODS}
    if "output_error" in found:
        found[TEXTBOOK_MODEL] = output_error.identify(record, structure="textbook")
    return found


def _row(record: FlightRecord, how: str, technique: str, key: str, value: float, estimates: dict[str, Estimate]
         ) -> Row:
    """One derivative by one method; a refusal agrees where two standard errors reach zero from what is printed."""
    e, likely = estimates[key], how == TEXTBOOK_MODEL
    rule, errors = (LIKELY, 1.0) if likely else (CLOSE, 2.0)
    text = f"{rule.text('1/rad')} or {errors:g} standard errors"
    quantity = f"{key} of {record.meta.name.removesuffix('_data')} ({how} against {technique})"
    if not e.identifiable:
        return Row(ITEM, quantity, "recorded", value, "refused", "1/rad", None, abs(value) <= 2.0*e.std_error,
                   f"{text}; refusal agrees where two errors reach zero", e.why)
    agrees = rule.holds(value, e.estimate) or abs(e.estimate - value) <= errors*e.std_error
    why = f"standard error {e.std_error:.2g}"
    return Row(ITEM, quantity, "recorded", value, e.estimate, "1/rad", 100.0*(e.estimate/value - 1.0), bool(agrees),
               text, why if agrees else f"{why}; {WHY.get(technique, 'the book fits its own stored columns')}")


def pictures(seed: int) -> list[Picture]:
    """All methods beside the textbook's equation error."""
    del seed
    found = []
    for name, record in records().items():
        series = {how: {key: (e.estimate, e.std_error) for key, e in estimates.items()
                        if e.identifiable and key in NAMES[name]} for how, estimates in identified(name).items()}
        reference = {key: value for key, value in printed("equation error", name).items() if key != "Cn_aileron"}
        figure = methods_compared({how: s for how, s in series.items() if s}, list(reference), reference)
        found.append(Picture(figure, f"Every method on {record.meta.name} with its 95 % interval; dashed, what the "
                             "textbook prints for equation error.", "Methods beside one another for each derivative"))
    return found
