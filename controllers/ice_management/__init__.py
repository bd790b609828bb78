"""The ice management system: sense, operate the ice protection, limit the envelope, adapt the control laws."""

from controllers.ice_management.management import init, step
from controllers.ice_management.operate import operate
from controllers.ice_management.power import judge as judge_power
from controllers.ice_management.tuning import load_tuning

__all__ = ["init", "judge_power", "load_tuning", "operate", "step"]
