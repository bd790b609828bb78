"""Controllers with and without protection on the same drawn cases: suites, episodes, figures of merit."""
