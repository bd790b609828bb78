"""The environment ids. Entry points are strings, so that the composition root is loaded only when one is made."""

from __future__ import annotations

import gymnasium

IDS: dict[str, str] = {
    "icing_env/TwinOtter-v0": "all",
    "icing_env/TwinOtterLongitudinal-v0": "longitudinal",
    "icing_env/TwinOtterLateral-v0": "lateral",
}


def register() -> None:
    """Make the ids known to Gymnasium; done on `import icing_env`."""
    for name, axes in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry_point="testbed.environments:make", kwargs={"axes": axes},
                               vector_entry_point="testbed.environments:make_vector")
