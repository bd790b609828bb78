"""Estimates by linear regression: equation error and what it may contain."""
