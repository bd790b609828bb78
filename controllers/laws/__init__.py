"""Control laws, one file each: targets, measurements and estimates to surfaces and power."""
