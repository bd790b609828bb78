"""Rivals of the H-infinity observer behind the same two functions, `init` and `step`, and over a record."""
