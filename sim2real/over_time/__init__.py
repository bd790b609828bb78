"""How the size of what was found went along the records."""
