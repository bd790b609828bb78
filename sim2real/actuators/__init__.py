"""From command to position: when commands act, where surfaces were, what actuators and engines do."""
