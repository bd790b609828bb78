"""Recorded channels made ready: checked, put on one time grid, smoothed, differentiated, as coefficients."""
