"""The parts put together: command line, experiments, reports."""
