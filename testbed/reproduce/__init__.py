"""The founding paper's tables and figures beside what flies and is identified here."""
