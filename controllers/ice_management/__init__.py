"""The ice management system: sense, operate the ice protection, limit the envelope, adapt the control laws."""

from controllers.ice_management.management import init, step
from controllers.ice_management.operate import operate
from controllers.ice_management.tuning import load_tuning

__all__ = ["init", "load_tuning", "operate", "step"]
