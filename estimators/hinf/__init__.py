"""The recursive H-infinity observer: in flight (`init`, `step`) and over a record (`estimators.hinf.record`)."""

from estimators.hinf.filter import step
from estimators.hinf.memory import OBSERVER, init

__all__ = ["OBSERVER", "init", "step"]
