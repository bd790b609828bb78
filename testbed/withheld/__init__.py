"""A benchmark of the diagnosis, flown by a plant of its own; nothing of the project is imported here."""
