"""Training: a run killed and resumed repeats the uninterrupted one, nothing is pickled, and what is learned flies."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sb3_contrib", reason="the extra `learning` is not installed")

from controllers.policies.policy import load
from icing_env.errors import InputError
from testbed.training import configuration, learner
from testbed.training.checkpoint import finished
from testbed.training.imitation import returns
from testbed.training.run import Order, begin, resumed
from testbed.training.ship import ship

ROOT = Path(__file__).resolve().parent.parent
SMALL = {"ppo": {"n_steps": 8, "batch_size": 32, "n_epochs": 2},
         "recurrent_ppo": {"n_steps": 8, "batch_size": 32, "n_epochs": 2},
         "sac": {"buffer_size": 400, "learning_starts": 32, "batch_size": 16, "gradient_steps": 2, "train_freq": 1}}


def order(algorithm, seed=0, steps=128, **changes):
    """A training of seconds: four aircraft, episodes of at most three."""
    name, chosen = configuration.load(algorithm)
    around = chosen.env_kwargs.model_copy(update={
        "shortest": 1.0, "changes": configuration.merged(chosen.env_kwargs.changes, {"duration": 3.0})})
    settings = {**chosen.hyperparameters, **SMALL[algorithm], **changes}
    chosen = chosen.model_copy(update={"n_envs": 4, "env_kwargs": around, "hyperparameters": settings, "evaluations": 4,
                                       "imitate": min(chosen.imitate, 2)})
    return Order(algorithm, name, chosen, seed, steps, "icing train")


def tensors(path):
    from safetensors.numpy import load_file

    return load_file(path)


def same_policies(one, other):
    for name in ("policy.safetensors", "last.safetensors"):
        a, b = tensors(one/name), tensors(other/name)
        assert a.keys() == b.keys() and all(np.array_equal(a[key], b[key]) for key in a), name


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "recurrent_ppo"])
def test_a_resumed_run_repeats_the_uninterrupted_one_bit_for_bit(algorithm, tmp_path):
    whole = begin(order(algorithm), tmp_path/"whole")
    assert whole.learn()
    assert not begin(order(algorithm), tmp_path/"parts").learn(minutes=0.0)  # stops at its first checkpoint
    while True:
        part = resumed(tmp_path/"parts")
        broken = Break(part)
        try:
            part.learn(progress=broken)
        except BrokenOff:
            continue
        break
    assert part.curve == whole.curve and len(whole.curve) == 5
    same_policies(tmp_path/"whole", tmp_path/"parts")


class BrokenOff(BaseException):
    """The process is gone."""


class Break:
    """Breaks a training off after one point of its curve, except on the last stretch."""

    def __init__(self, run):
        self.left = 1 if len(run.curve) < 4 else 99

    def __call__(self, steps, total, point):
        self.left -= 1
        if self.left <= 0 and steps < total:
            raise BrokenOff


def test_a_shipped_policy_takes_its_whole_curve_along(tmp_path):
    begin(order("ppo", steps=64), tmp_path/"run").learn()
    path = ship(tmp_path/"run", tmp_path)
    policy = load(path)
    assert path.name == "ppo_targets_protected_0.safetensors"
    assert policy.card["curve"] == json.loads((tmp_path/"run"/"curve.json").read_text())
    assert policy.card["steps_learned"] == 64 and policy.card["command"] == "icing train"
    same = tensors(tmp_path/"run"/"policy.safetensors")
    assert all(np.array_equal(array, same[name]) for name, array in tensors(path).items())


def test_a_checkpoint_holds_no_pickle(tmp_path):
    run = begin(order("sac", steps=64), tmp_path/"run")
    run.learn()
    latest = finished(tmp_path/"run"/"checkpoints")[-1]
    assert sorted(path.name for path in latest.iterdir()) == ["arrays.npz", "state.json", "tensors.safetensors"]
    with np.load(latest/"arrays.npz", allow_pickle=False) as arrays:
        assert {arrays[name].dtype.hasobject for name in arrays.files} == {False}


@pytest.mark.parametrize("name", ["arrays.npz", "state.json", "tensors.safetensors"])
def test_a_cut_checkpoint_is_one_clear_line(name, tmp_path):
    begin(order("ppo", steps=32), tmp_path/"run").learn()
    path = finished(tmp_path/"run"/"checkpoints")[-1]/name
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match="not a whole checkpoint"):
        resumed(tmp_path/"run")


def test_a_run_of_another_size_is_refused(tmp_path):
    begin(order("ppo", steps=32), tmp_path/"run").learn()
    path = tmp_path/"run"/"run.json"
    data = json.loads(path.read_text())
    data["configuration"]["n_envs"] = 5
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match="checkpoint"):
        resumed(tmp_path/"run")


def test_a_directory_is_not_begun_twice(tmp_path):
    begin(order("ppo", steps=32), tmp_path/"run")
    with pytest.raises(InputError, match="--resume"):
        begin(order("ppo", steps=32), tmp_path/"run")


def test_a_diverging_learner_is_one_clear_line_and_its_checkpoint_stands(tmp_path):
    import torch

    run = begin(order("ppo"), tmp_path/"run")
    run.learn(minutes=0.0)
    with torch.no_grad():
        run.model.policy.action_net.bias[0] = float("nan")
    with pytest.raises(InputError, match="diverged"):
        learner.learn(run.model, 32)
    assert resumed(tmp_path/"run").learn()


def test_the_policy_that_flies_is_the_one_that_was_learned(tmp_path):
    import torch

    for algorithm in ("ppo", "sac"):
        run = begin(order(algorithm, steps=32), tmp_path/algorithm)
        run.learn()
        policy = load(tmp_path/algorithm/"last.safetensors")
        policy.start(run.model.env.parts[0].world.view.channels, 3)
        seen = np.random.default_rng(0).normal(0.0, 2.0, (3, len(run.channels))).astype(np.float32)
        with torch.no_grad():
            wanted, _ = run.model.predict(run.model.env.features(seen), deterministic=True)
        assert np.max(np.abs(policy.act(seen) - wanted)) < 1e-5
        assert policy.card["steps_flown"] >= 32 and policy.card["seed"] == 0


def test_a_recurrent_policy_remembers_as_it_learned_to(tmp_path):
    run = begin(order("recurrent_ppo", steps=32), tmp_path/"run")
    run.learn()
    policy = load(tmp_path/"run"/"last.safetensors")
    policy.start(run.model.env.parts[0].world.view.channels, 2)
    state, start = None, np.ones(2, bool)
    for k in range(3*policy.hold):
        seen = np.random.default_rng(k).normal(0.0, 2.0, (2, len(run.channels))).astype(np.float32)
        flown = policy.act(seen)
        if k % policy.hold == 0:
            wanted, state = run.model.predict(run.model.env.features(seen), state=state, episode_start=start,
                                              deterministic=True)
            start = np.zeros(2, bool)
        assert np.max(np.abs(flown - wanted)) < 1e-5


@pytest.mark.slow
def test_a_killed_process_loses_at_most_one_interval(tmp_path):
    out = tmp_path/"run"
    command = [sys.executable, "-m", "testbed.cli", "train", "ppo", "--config", "limits", "--steps", "400000"]
    process = subprocess.Popen([*command, "--out", str(out)], env=os.environ | {"PYTHONPATH": str(ROOT)}, cwd=tmp_path)
    while not (out/"curve.json").exists() or len(json.loads((out/"curve.json").read_text())) < 3:
        time.sleep(0.1)
        assert process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    before = json.loads((out/"curve.json").read_text())
    run = resumed(out)
    assert run.curve in (before, before[:-1])
    run.learn(minutes=0.0)
    assert not list((out/"checkpoints").glob("unfinished")) or finished(out/"checkpoints")


def test_a_mistyped_configuration_names_the_nearest():
    with pytest.raises(InputError, match="targets_protected"):
        configuration.load("ppo", "target_protected")
    with pytest.raises(InputError, match="ppo"):
        configuration.load("pppo")


def test_every_configuration_loads_and_its_scenarios_with_it():
    for algorithm in configuration.ALGORITHMS:
        for name in configuration.read(algorithm):
            _, chosen = configuration.load(algorithm, name)
            assert configuration.scenarios_of(chosen.env_kwargs), name


def test_returns_are_discounted_sums():
    reward = np.array([[1.0], [2.0], [3.0]], np.float32)
    last = 3.0 + 0.5*2.0/0.5
    assert np.allclose(returns(reward, 0.5)[:, 0], [1.0 + 0.5*(2.0 + 0.5*last), 2.0 + 0.5*last, last])
