"""From measurements to estimates: the H-infinity observer, equation error, and what a record can show at all."""
