"""From estimates and trim to ice: severity per surface, onset, and whether the ice protection works."""
