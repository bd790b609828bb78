"""A recorded flight predicted from another: derivatives of the one, controls of the other, no aerodynamics refitted.

Records 018 and 017 of NASA's Twin Otter, 13 February 2002. Only the datum of the predicted record (first state,
constant coefficients, constant errors of instruments) is fitted to it.
"""

from __future__ import annotations

from estimators.estimate import Estimate
from estimators.methods import METHODS, method
from icing_env.record import FlightRecord, read
from testbed.reports.flown_again import FlownAgain, fly_again
from testbed.reports.identification_figures import fit_histories
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row
from testbed.textbook import folder

ITEM = "prediction"
SOURCE, TARGET = "totter_demo_data.mat", "totter_pred_data.mat"
CHANNELS = ("alpha", "q", "az")
GOOD = 0.9  # share of variance from which a record counts as predicted (assumed)


def rows(seed: int) -> list[Row]:
    """Share of the variance of alpha, q and az that each method's derivatives explain in the record not used."""
    del seed
    pair = both()
    if pair is None:
        return []
    found = []
    for how in METHODS:
        estimates = method(how)(pair[0])
        flown = predicted(estimates, pair[1])
        found += [_row(how, channel, flown, estimates) for channel in CHANNELS]
    return found


def both() -> tuple[FlightRecord, FlightRecord] | None:
    """The record identified and the record predicted, where both are present."""
    paths = [folder()/SOURCE, folder()/TARGET]
    return (read(paths[0]), read(paths[1])) if all(path.is_file() for path in paths) else None


def predicted(estimates: dict[str, Estimate], record: FlightRecord) -> FlownAgain | None:
    """The longitudinal flight of a record by derivatives from elsewhere; None where these were refused."""
    return next((f for f in fly_again(record, estimates) if f.axis == "longitudinal"), None)


def _row(how: str, channel: str, flown: FlownAgain | None, estimates: dict[str, Estimate]) -> Row:
    quantity = f"{channel} of record 017 from the derivatives of 018 ({how})"
    text = f"share of variance {GOOD:g} or more"
    if flown is None:
        return Row(ITEM, quantity, "recorded", "a good prediction", "refused", "1", None, False, text,
                   estimates["Cm_alpha"].why)
    share = flown.r2[channel]
    return Row(ITEM, quantity, "recorded", "a good prediction", share, "1", None, share >= GOOD, text,
               "flown freely through the recorded elevator, speed and attitude; datum fitted")


def pictures(seed: int) -> list[Picture]:
    """The predicted flight by stepwise regression's derivatives, over what was measured."""
    del seed
    pair = both()
    if pair is None:
        return []
    flown = predicted(method("stepwise")(pair[0]), pair[1])
    if flown is None:
        return []
    figure = fit_histories(flown, {"elevator": pair[1]["elevator"]})
    return [Picture(figure, "Prediction: record 017 flown with the derivatives that stepwise regression found in "
                    "record 018. Dashed, measured.", "Predicted and measured histories lie on one another")]
