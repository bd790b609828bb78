"""Envelope protection between any controller and the actuators, one way to keep the limits per file."""
