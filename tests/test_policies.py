"""Learned policies in flight: what the file must be, a batch flies as one alone, PyTorch agrees."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

from controllers.policies.files import Network, find, read, shapes, shipped, write
from controllers.policies.policy import Policy
from icing_env import scenario as scenarios
from icing_env.actions import names
from icing_env.errors import InputError
from icing_env.observation import channels
from testbed.environments import loop_factory
from testbed.piloted import Piloted

SEEN = tuple(c.name for c in channels("all"))


def network(memory=0, mode="targets", hold=1, **changes):
    first = memory or len(SEEN)
    return Network(**{"mode": mode, "hold": hold, "channels": SEEN, "actions": names(mode, "all"),
                      "sizes": (first, 16, len(names(mode, "all"))), "memory": memory, **changes})


def tensors(net, seed=0):
    rng = np.random.default_rng(seed)
    return {name: rng.normal(0.0, 0.3, shape).astype(np.float32) for name, shape in shapes(net).items()}


def observations(n, seed=1):
    return np.random.default_rng(seed).normal(0.0, 3.0, (n, len(SEEN))).astype(np.float32)


@pytest.mark.parametrize("memory", [0, 8])
def test_a_batch_acts_bit_for_bit_as_each_row_alone(memory):
    net = network(memory)
    batch, alone = (Policy(net, tensors(net)) for _ in range(2))
    batch.start(channels("all"), 5)
    seen = [observations(5, k) for k in range(4)]
    together = [batch.act(s).copy() for s in seen]
    for i in range(5):
        alone.start(channels("all"), 1)
        for k, s in enumerate(seen):
            assert np.array_equal(alone.act(s[i:i + 1])[0], together[k][i])


def test_an_action_stands_for_its_steps_and_a_reset_row_begins_anew():
    net = network(memory=8, hold=3)
    policy = Policy(net, tensors(net))
    policy.start(channels("all"), 2)
    seen = [observations(2, k) for k in range(7)]
    actions = [policy.act(s).copy() for s in seen[:3]]
    assert np.array_equal(actions[0], actions[2])
    assert not np.array_equal(policy.act(seen[3]), actions[0])
    policy.reset(np.array([1]))
    again = policy.act(seen[0])
    assert np.array_equal(again[1], actions[0][1]) and not np.array_equal(again[0], actions[0][0])


def test_a_written_policy_is_read_back(tmp_path):
    net = network()
    write(tmp_path/"p.safetensors", net, tensors(net), {"command": "icing train ppo"})
    back, numbers, card = read(tmp_path/"p.safetensors")
    assert back == net and card["command"] == "icing train ppo"
    assert all(np.array_equal(numbers[name], array) for name, array in tensors(net).items())


def spoilt(kind, whole, path):
    """A policy file with something wrong."""
    net = network()
    if kind == "truncated":
        path.write_bytes(whole[:len(whole)//2])
    elif kind == "pickle":
        path.write_bytes(pickle.dumps({"weights": [1.0]}))
    elif kind == "empty":
        path.write_bytes(b"")
    elif kind == "format":
        path.write_bytes(whole.replace(b"icing-policy/1", b"icing-policy/9"))
    elif kind == "json":
        path.write_bytes(whole.replace(b'\\"mode\\"', b'\\"mood\\"'))
    elif kind == "nan":
        numbers = tensors(net)
        numbers["layer.0.bias"][3] = np.nan
        write(path, net, numbers, {})
    elif kind == "shape":
        write(path, net, tensors(net) | {"layer.0.bias": np.zeros(5, np.float32)}, {})
    elif kind == "missing":
        write(path, net, {k: v for k, v in tensors(net).items() if k != "centre"}, {})
    elif kind == "channel":
        write(path, network(channels=("airspeeed", *SEEN[1:])), tensors(net), {})


@pytest.mark.parametrize("kind", ["truncated", "pickle", "empty", "format", "json", "nan", "shape", "missing",
                                  "channel"])
def test_a_spoilt_file_is_one_clear_line(kind, tmp_path):
    net, path = network(), tmp_path/"p.safetensors"
    write(path, net, tensors(net), {})
    spoilt(kind, path.read_bytes(), path)
    with pytest.raises(InputError, match=r"p\.safetensors") as raised:
        read(path)
    assert "\n" not in str(raised.value)


def test_a_policy_for_other_spaces_is_refused_before_the_flight():
    net = network()
    policy = Policy(net, tensors(net))
    with pytest.raises(InputError, match="does not hold"):
        policy.start(channels("lateral"), 1)
    other = network(actions=("bank", "airspeed", "climb_rate"))
    with pytest.raises(InputError, match="actions"):
        Policy(other, tensors(other)).start(channels("all"), 1)


@pytest.mark.parametrize("mode", ["targets", "surfaces", "limits"])
def test_a_policy_flies_a_world(mode):
    net = network(mode=mode, hold=5)
    world = Piloted(Policy(net, tensors(net)), scenarios.load("stratiform", duration=2.0), 3, loop_factory())
    world.reset(seeds=[1, 2, 3])
    for _ in range(20):
        world.step()
    assert np.all(np.isfinite(world.observation)) and np.any(world.action != 0.0)


def test_moved_limits_are_those_that_the_flight_obeys():
    from icing_env.actions import AIRSPEED_LIMIT
    from icing_env.world import World

    scenario = scenarios.load("stratiform", duration=20.0, parameters={"turbulence_sigma_w": 0.0},
                              randomise={"initial": {"airspeed": {"low": 70.0, "high": 70.0}}})
    world = World(scenario, 2, loop_factory(observer=False), mode="limits")
    world.reset(seeds=[1, 1])
    advised = world.loop.advisory["airspeed_limit"].copy()
    world.step(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32))
    shown = world.loop.advisory["airspeed_limit"]
    assert shown[0] == shown[1] == pytest.approx(advised[0], abs=0.05)  # advised anew, not added up

    world.loop.advisory["airspeed_limit"] = 73.0  # what the action moves is what autopilot and protection meet
    world.loop.observe = world._observe = lambda: None
    world.step(np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], np.float32))
    assert np.allclose(world.loop.advisory["airspeed_limit"], [73.0 - AIRSPEED_LIMIT, 73.0 + AIRSPEED_LIMIT])


def test_torch_agrees():
    torch = pytest.importorskip("torch", reason="the extra `learning` is not installed")
    net = network(memory=8)
    numbers = tensors(net)
    policy = Policy(net, numbers)
    policy.start(channels("all"), 4)
    cell = torch.nn.LSTMCell(len(SEEN), 8)
    with torch.no_grad():
        cell.weight_ih.copy_(torch.from_numpy(numbers["memory.input"].T))
        cell.weight_hh.copy_(torch.from_numpy(numbers["memory.hidden"].T))
        cell.bias_ih.copy_(torch.from_numpy(numbers["memory.bias"]))
        cell.bias_hh.zero_()
        state = (torch.zeros(4, 8), torch.zeros(4, 8))
        for k in range(5):
            seen = observations(4, k)
            x = torch.asinh(torch.from_numpy((seen - numbers["centre"])*numbers["per_scale"]))
            state = cell(x, state)
            hidden = torch.tanh(state[0] @ torch.from_numpy(numbers["layer.0.weight"]) + torch.from_numpy(
                numbers["layer.0.bias"]))
            wanted = hidden @ torch.from_numpy(numbers["layer.1.weight"]) + torch.from_numpy(numbers["layer.1.bias"])
            assert np.max(np.abs(policy.act(seen) - np.clip(wanted.numpy(), -1.0, 1.0))) < 1e-6


def test_the_network_in_the_metadata_is_plain_json(tmp_path):
    net = network()
    write(tmp_path/"p.safetensors", net, tensors(net), {})
    head = (tmp_path/"p.safetensors").read_bytes()
    length = int.from_bytes(head[:8], "little")
    assert json.loads(json.loads(head[8:8 + length])["__metadata__"]["network"])["mode"] == "targets"


@pytest.mark.parametrize("name", shipped())
def test_a_shipped_policy_says_how_it_was_made(name):
    net, _, card = read(find(name))
    assert name == f"{card['algorithm']}_{card['name']}_{card['seed']}"
    assert card["command"].startswith(f"icing train {card['algorithm']} --config {card['name']}")
    assert card["curve"][-1]["steps"] == card["steps_learned"] >= card["steps_flown"]
    assert card["configuration"]["env_kwargs"]["mode"] == net.mode
