"""Whitened innovations and signatures of all that is tried, as inner products; what evidence is divided by."""
