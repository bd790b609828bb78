"""From inner products to probabilities: effects, sets of them, other forms, something unknown."""
