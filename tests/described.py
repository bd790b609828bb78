"""Records of an aircraft that has the effect `discrepancy`, in light gusts."""

from icing_env import scenario
from testbed.flight import fly

GUST = 0.5  # m/s


def record(values: dict, seed: int, **parameters: float):
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": GUST} | parameters,
                           effects={"discrepancy": values})  # fmt: skip
    return fly(chosen, seed=seed, observer=False, protection=False).record
