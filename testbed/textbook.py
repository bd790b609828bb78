"""What the textbook prints of NASA's Twin Otter records, and where those records lie.

The records belong to third parties and are not part of the project.
"""

from __future__ import annotations

import os
from pathlib import Path

# Klein & Morelli, Aircraft System Identification (AIAA 2006), examples 5.1 and 5.2, and SIDPAC's demonstration on the
# longitudinal record; as printed, for the digits count.
BOOK = {
    "totter_demo_data.mat": {
        "CZ_alpha": "-6.349", "CZ_q": "-18.41", "CZ_elevator": "-0.626",
        "Cm_alpha": "-1.4762", "Cm_q": "-36.35", "Cm_elevator": "-1.8688",
    },
    "totter_f1_017_data.mat": {
        "CY_beta": "-0.8451", "CY_r": "0.9631", "CY_rudder": "0.3426",
        "Cl_beta": "-0.1051", "Cl_p": "-0.5283", "Cl_r": "0.1926", "Cl_aileron": "-0.2117", "Cl_rudder": "0.0299",
        "Cn_beta": "0.08544", "Cn_p": "-0.05151", "Cn_r": "-0.19758", "Cn_aileron": "0.00234",
        "Cn_rudder": "-0.13054",
    },
}  # fmt: skip


def folder() -> Path:
    """Where recorded flights lie, if anywhere: ICING_FLIGHT_DATA, else shared/flight_data beside the checkout."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "flight_data"
    return Path(os.environ.get("ICING_FLIGHT_DATA") or beside)
