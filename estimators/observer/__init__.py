"""What every recursive identifier shares: flight equations, matched filters, excitation, its run over a record."""
