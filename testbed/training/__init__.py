"""Learning to fly: Stable-Baselines3 over batches of aircraft, checkpoints without pickle, policies as safetensors."""
