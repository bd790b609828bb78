"""Train PPO to fly autopilot targets through icing (extra `learning`): `python examples/train_ppo.py 200000`."""

import sys

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from testbed.sb3 import TwinOtterVecEnv

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
batch = VecNormalize(VecMonitor(TwinOtterVecEnv(64, scenario="clear_air", mode="targets", changes={
    "task": {"kind": "hold"}, "weather": "stratiform", "duration": 60.0, "parameters": {"turbulence_sigma_w": 1.0},
    "randomise": {"initial": {"airspeed": {"low": 60.0, "high": 78.0}},
                  "eta": {"left_wing": {"low": 0.0, "high": 0.1}}}})))
model = PPO("MlpPolicy", batch, n_steps=256, batch_size=2048, verbose=1, device="cpu", seed=1)
model.learn(steps)
