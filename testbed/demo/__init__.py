"""The demonstration: what the testbed does, part by part, in one report."""
