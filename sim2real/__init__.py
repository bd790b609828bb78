"""Where a flight record and the simulator differ, which effect causes it, and how far it can be closed."""
