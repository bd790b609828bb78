"""What is measured, one subject a file: speed, protection, adaptation, diagnosis, recorded flights, coverage."""
