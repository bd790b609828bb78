"""Train an envelope-protection policy that moves the advised limits, then fly it beside the limits as advised.

Extra `learning`: `python examples/train_protection.py 40000`. The same from the command line:
`icing train ppo --config limits --steps 40000 --out runs/limits`.
"""

import sys
from pathlib import Path

from controllers import policies
from testbed.comparison.suite import load as suite
from testbed.comparison.trace import trace
from testbed.environments import loop_factory
from testbed.flight import make_world
from testbed.piloted import Piloted
from testbed.training import configuration
from testbed.training.run import Order, begin

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 300_000
folder = Path("runs/limits")
name, chosen = configuration.load("ppo", "limits")
run = begin(Order("ppo", name, chosen, 0, steps, " ".join(sys.argv)), folder)
run.learn(progress=lambda done, total, point: print(f"{done}/{total} decisions, reward {point['reward']:.3f}"))

cases = {case.name: case for label, case in suite("standard").cases() if label == "moderate"}
holding = cases["holding_asymmetric"]
policy = policies.load(folder/"policy.safetensors")
worlds = {"learned limits": Piloted(policy, holding, 8, loop_factory()), "advised limits": make_world(holding, 8)}
for who, world in worlds.items():
    flown = trace(world, list(range(8)))
    print(f"{who}: least margin to the iced stall {flown['alpha_margin'].min():.3f} rad, "
          f"altitude error {abs(flown['altitude_error']).mean():.1f} m, lost {sum(map(bool, flown.reason))} of 8")
