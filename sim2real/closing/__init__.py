"""The gap in tolerances, the model with its cause added, and how much of it closes."""
