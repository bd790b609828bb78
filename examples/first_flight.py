"""Fly a minute through an icing cloud with the autopilot's targets and watch the observer."""

import gymnasium as gym
import numpy as np

import icing_env  # noqa: F401  registers the environments

env = gym.make("icing_env/TwinOtter-v0", scenario="stratiform", mode="targets").unwrapped
observation, info = env.reset(seed=1)
hold = np.zeros(3, np.float32)  # level flight at the task's airspeed, wings level
for step in range(3000):
    observation, reward, terminated, truncated, info = env.step(hold)
    if step % 500 == 0:
        seen = dict(zip(env.observation_names, observation, strict=True))
        print(f"{step/50:3.0f} s  airspeed {seen['airspeed']:.1f} m/s  excess drag {seen['excess_drag']:.4f}  "
              f"CL_alpha {100*seen['CL_alpha']:.0f} % of clean  severity {seen['severity']:.2f}")
    if terminated or truncated:
        break
