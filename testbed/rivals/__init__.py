"""Diagnoses of other kinds, for comparison: what simpler means make of the records that `icing diagnose` is given."""

RIVALS = ("bic", "regression", "output_error")  # each a module here with `consider(records)` and its `SCALE`
