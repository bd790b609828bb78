"""Flight records as a simulation needs them: time, controls, instruments, noise, start."""
