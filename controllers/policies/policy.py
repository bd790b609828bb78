"""A learned policy in flight: from observations to actions, without PyTorch.

A world made with the policy's `mode` and `axes` is flown by `policy.start(world.view.channels, world.n)` after a reset
and `world.action[:] = policy.act(world.view.out)` before each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.policies.files import Network, find, read
from controllers.policies.network import RELU, TANH, act
from icing_env.actions import names
from icing_env.errors import InputError
from icing_env.observation import Channel


class Policy:
    """One network and the state of it in `n` aircraft.

    Args:
        network: what the tensors mean.
        tensors: by name, as in a policy file.
        card: how it was made.
    """

    def __init__(self, network: Network, tensors: dict[str, NDArray[Any]], card: dict[str, Any] | None = None) -> None:
        self.network, self.card = network, card or {}
        self.mode, self.axes, self.hold = network.mode, network.axes, network.hold
        self._centre, self._per_scale = tensors["centre"].astype(float), tensors["per_scale"].astype(float)
        self._weights = flat(network, tensors)
        self._sizes = np.array(network.sizes, np.int64)
        self._kind = TANH if network.activation == "tanh" else RELU
        self._columns: NDArray[np.int64] | None = None
        self.allocate(1)

    def allocate(self, n: int) -> None:
        """Room for `n` aircraft, all at the beginning of an episode."""
        units = self.network.memory
        self.age, self.action = np.zeros(n, np.int64), np.zeros((n, len(self.network.actions)), np.float32)
        self.hidden, self.cell = np.zeros((n, units)), np.zeros((n, units))
        self._work = np.zeros((3, max(len(self.network.channels), *self.network.sizes, 4*units)))

    def start(self, channels: Sequence[Channel], n: int) -> None:
        """Begin `n` episodes, seen through these channels.

        Raises:
            InputError: the policy sees a channel that is not among them, or acts on something else.
        """
        there = [channel.name for channel in channels]
        for name in self.network.channels:
            if name not in there:
                raise InputError(f"the policy sees '{name}', which the observation of these axes does not hold")
        if names(self.mode, self.axes) != self.network.actions:
            raise InputError(f"the policy's actions are {', '.join(self.network.actions)}, those of mode '{self.mode}' "
                             f"are {', '.join(names(self.mode, self.axes))}")
        columns = [there.index(name) for name in self.network.channels]
        self._columns = None if columns == list(range(len(there))) else np.array(columns)
        self.allocate(n)

    def reset(self, rows: NDArray[Any]) -> None:
        """Forget what these rows remember: their episodes begin anew."""
        self.age[rows], self.hidden[rows], self.cell[rows] = 0, 0.0, 0.0

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions [n, actions] in [-1, 1] for observations [n, channels]; the array is written anew in each step."""
        seen = observation if self._columns is None else np.ascontiguousarray(observation[:, self._columns])
        act(seen, self._centre, self._per_scale, self._weights, self._sizes, self.network.memory, self._kind,
            self.network.squash, self.hold, self.age, self.hidden, self.cell, self._work, self.action)
        return self.action


def flat(network: Network, tensors: dict[str, NDArray[Any]]) -> NDArray[np.float64]:
    """All weights in one array, in the order in which `network.act` reads them."""
    order = ["memory.input", "memory.hidden", "memory.bias"] if network.memory else []
    order += [f"layer.{k}.{part}" for k in range(len(network.sizes) - 1) for part in ("weight", "bias")]
    return np.concatenate([tensors[name].astype(float).ravel() for name in order])


def load(name: str | Path) -> Policy:
    """A policy by its name among the shipped ones, or from a file.

    Raises:
        InputError: no such policy, or a file that is not a whole and fitting one.
    """
    return Policy(*read(find(name)))
