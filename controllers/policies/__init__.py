"""Learned controllers: networks trained by `icing train`, flown without PyTorch."""

from controllers.policies.files import shipped as policies
from controllers.policies.policy import Policy, load

__all__ = ["Policy", "load", "policies"]
