"""Training and judging the characteriser: simulated flights, fits, thresholds, and the figures that it reaches."""
