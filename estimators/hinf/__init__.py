"""The recursive H-infinity observer: in flight (`init`, `step`) and over a record (`estimators.hinf.record`)."""

from estimators.hinf.filter import step
from estimators.hinf.memory import OBSERVER, init
from estimators.hinf.tuning import default_tuning

__all__ = ["OBSERVER", "default_tuning", "init", "step"]
