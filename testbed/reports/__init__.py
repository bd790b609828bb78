"""Results as self-contained pages: text, figures, tables, and the looks that they share."""
