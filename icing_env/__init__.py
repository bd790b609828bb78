"""The world: aircraft, weather, ice, instruments, and the Gymnasium environment."""
