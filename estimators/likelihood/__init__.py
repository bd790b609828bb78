"""Maximum likelihood: parametric models flown through the recorded inputs and fitted to what was measured."""
