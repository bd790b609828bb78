"""Leading explanations flown where they fit, and settled there: their slopes, other forms, companions."""
