"""A world in which a learned policy flies: it looks and acts before each step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.policies import Policy
from icing_env.loop import LoopFactory
from icing_env.scenario import Scenario
from icing_env.world import World


class Piloted(World):
    """`World` whose actions are a policy's.

    Args:
        policy: who flies; its mode and axes are those of the actions.
        scenario, n, loop, settings: as in `World`.

    Raises:
        InputError: the policy is for other observations or actions.
    """

    def __init__(self, policy: Policy, scenario: Scenario, n: int, loop: LoopFactory, **settings: Any) -> None:
        super().__init__(scenario, n, loop, mode=policy.mode, axes=policy.axes, **settings)
        self.policy = policy
        policy.start(self.view.channels, n)

    def reset(self, rows: NDArray | None = None, seeds: Sequence[int] | None = None,
              initial: dict[str, Any] | None = None) -> None:
        """Begin new episodes; the policy forgets the old ones."""
        super().reset(rows, seeds, initial)
        self.policy.reset(np.arange(self.n) if rows is None else np.asarray(rows))

    def step(self, action: NDArray | None = None) -> None:
        """One step of every aircraft; an action from outside has no say."""
        super().step(self.policy.act(self.view.out))
