"""What is tried against a record: effects at several sizes, the model's own uncertainty, generic terms."""
