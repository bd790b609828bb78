"""One-step predictions of a record by many variants of the plant, and the filter's gain; free flight in windows."""
