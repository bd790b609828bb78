"""What records could reveal, flown or not, and what to fly next."""
