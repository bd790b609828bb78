"""What does an estimator buy? The same iced flights, boots off, with the observer in the loop and with a blind one."""

import numpy as np

from icing_env import scenario
from icing_env.world import World
from testbed.environments import loop_factory

iced = scenario.load("clear_air", task={"kind": "doublets"}, duration=90.0, weather="stratiform",
                     initial={"eta": {"left_wing": 0.08, "right_wing": 0.08, "htail": 0.08, "struts": 0.08}})
for name, observer in (("observer", True), ("blind", False)):
    world = World(iced, 16, loop_factory(observer=observer, boots=False))
    world.reset(seeds=range(16))
    margin = np.inf
    while not world.truncated.all():
        world.step()
        current = world.fleet.current
        margin = min(margin, float(np.min(current["alpha_stall_left"] - world.fleet.outcome["alpha"])))
    severity = float(np.mean(world.loop.advisory["severity"]))
    limit = float(np.degrees(np.mean(world.loop.advisory["alpha_limit"])))
    print(f"{name:9s} severity {severity:.2f}, alpha limit {limit:.1f} deg, "
          f"least margin to stall {np.degrees(margin):.1f} deg")
