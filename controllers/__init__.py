"""From estimates to actions: ice management, envelope protection, classical laws and learned policies."""
