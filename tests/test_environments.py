"""Contracts of every registered id and option: both checkers, seeding, autoreset, bad actions, save and restore."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import icing_env  # noqa: F401  registers the ids
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.observation import CHANNELS
from icing_env.registration import IDS
from icing_env.tasks import TASKS

OPTIONS: list[dict[str, Any]] = [
    {}, {"mode": "targets"}, {"observer": False, "management": False, "protection": False},
    {"observer": False, "mode": "targets"}, {"protection": False},
]  # fmt: skip


def make(name: str = "icing_env/TwinOtter-v0", **options: Any) -> Any:
    return gym.make(name, disable_env_checker=True, **options).unwrapped


def icing(**changes: Any) -> dict[str, Any]:
    """Changes of a scenario with everything random on: turbulence, cloud, drawn aircraft."""
    return {"weather": "stratiform", "parameters": {"turbulence_sigma_w": 1.5},
            "randomise": {"parameters": {"mass": {"low": 4500.0, "high": 5300.0}},
                          "effects": {"elevator_power": {"change": {"low": -0.2, "high": 0.2}}},
                          "eta": {"left_wing": {"low": 0.0, "high": 0.1}},
                          "initial": {"airspeed": {"low": 65.0, "high": 75.0}}}, **changes}


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_gymnasium_accepts_every_id_and_option(name: str, options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(name, render_mode="rgb_array", **options).unwrapped, skip_render_check=bool(options))


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_stable_baselines_accepts_every_id_and_option(name: str, options: dict[str, Any]) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="the extra `learning` is absent")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gym.make(name, **options).unwrapped)


@pytest.mark.parametrize("task", TASKS)
def test_every_task_can_be_flown_by_the_autopilot_targets(task: str) -> None:
    env = make(mode="targets", changes={"task": {"kind": task}, "duration": 20.0})
    env.reset(seed=1)
    for _ in range(999):
        observation, reward, terminated, truncated, info = env.step(np.zeros(3, np.float32))
        assert env.observation_space.contains(observation) and np.isfinite(reward)
        assert not terminated and not truncated
        assert sum(info["reward_terms"].values()) == pytest.approx(reward)
    assert env.step(np.zeros(3, np.float32))[3], "20 s are 1000 steps"


def test_full_nose_down_ends_an_episode_and_says_why() -> None:
    env = make(observer=False, management=False, protection=False, changes={"duration": 60.0})
    env.reset(seed=1)
    done, info, steps = False, {}, 0
    while not done:
        _, reward, done, truncated, info = env.step(np.array([1.0, 0.0, 0.0, 1.0], np.float32))
        steps += 1
        assert not truncated
    assert info["reason"] in ("ground", "structure", "upset") and reward < -50.0 and steps < 3000


def test_the_same_seed_is_the_same_flight_and_another_is_not() -> None:
    flights = []
    for seed in (5, 5, 6):
        env = make(changes=icing())
        env.reset(seed=seed)
        flights.append([env.step(np.full(4, 0.01, np.float32))[0] for _ in range(100)][-1])
    assert np.array_equal(flights[0], flights[1]) and not np.array_equal(flights[0], flights[2])


@pytest.mark.parametrize("options", OPTIONS[:3], ids=str)
def test_a_row_of_a_batch_flies_as_alone_bit_for_bit(options: dict[str, Any]) -> None:
    n, changes = 5, icing(duration=3.0)
    batch = gym.make_vec("icing_env/TwinOtter-v0", num_envs=n, changes=changes, threads=2, **options)
    seen, _ = batch.reset(seed=40)
    alone = [make(changes=changes, **options) for _ in range(n)]
    assert np.array_equal(seen, [env.reset(seed=40 + i)[0] for i, env in enumerate(alone)])
    rng = np.random.default_rng(0)
    for _ in range(120):
        action = rng.uniform(-0.2, 0.2, batch.action_space.shape).astype(np.float32)
        seen, reward, _, _, _ = batch.step(action)
        for i, env in enumerate(alone):
            one = env.step(action[i])
            assert np.array_equal(seen[i], one[0]) and reward[i] == one[1]


def test_turbulence_moves_no_draw_of_the_ice() -> None:
    ice = []
    for sigma in (0.0, 2.0):
        env = make(changes={"weather": "stratiform", "parameters": {"turbulence_sigma_w": sigma}}, mode="targets")
        env.reset(seed=3)
        for _ in range(1500):
            env.step(np.zeros(3, np.float32))
        ice.append(env.world.fleet.state["cloud_lwc_mean"][0])
    assert ice[0] == ice[1] > 0.0


def test_next_step_resets_a_step_later_with_reward_zero() -> None:
    env = gym.make_vec("icing_env/TwinOtter-v0", num_envs=2, changes={"duration": 0.2})
    assert env.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    env.reset(seed=1)
    action = np.zeros((2, 4), np.float32)
    for _ in range(9):
        assert not env.step(action)[3].any()
    assert env.step(action)[3].all()
    seen, reward, terminated, truncated, _ = env.step(action)
    assert not terminated.any() and not truncated.any() and not reward.any()
    assert (env.unwrapped.world.steps == 0).all() and (env.unwrapped.world.episode == 1).all()
    assert np.array_equal(seen, env.unwrapped.world.observation)


def test_same_step_hands_over_the_last_observation() -> None:
    env = gym.make_vec("icing_env/TwinOtter-v0", num_envs=2, changes={"duration": 0.2}, autoreset_mode="SameStep")
    twin = gym.make_vec("icing_env/TwinOtter-v0", num_envs=2, changes={"duration": 0.2}, autoreset_mode="NextStep")
    env.reset(seed=1)
    twin.reset(seed=1)
    action = np.full((2, 4), 0.1, np.float32)
    for _ in range(10):
        seen, _, _, truncated, info = env.step(action)
        last = twin.step(action)[0]
    assert truncated.all() and info["_final_obs"].all()
    assert np.array_equal(np.stack(list(info["final_obs"])), last)
    assert np.array_equal(seen, twin.step(action)[0])


def test_disabled_autoreset_wants_a_reset_mask() -> None:
    env = gym.make_vec("icing_env/TwinOtter-v0", num_envs=3, changes={"duration": 0.2}, autoreset_mode="Disabled")
    env.reset(seed=1)
    action = np.zeros((3, 4), np.float32)
    for _ in range(10):
        env.step(action)
    with pytest.raises(InputError, match="row 0 has ended"):
        env.step(action)
    before = env.unwrapped.world.fleet.state[2].copy()
    env.reset(options={"reset_mask": np.array([True, True, False])})
    assert env.unwrapped.world.fleet.state[2] == before and (env.unwrapped.world.steps == [0, 0, 10]).all()
    for mask in (np.array([1, 0, 0]), np.zeros(3, bool), np.ones(2, bool)):
        with pytest.raises(InputError, match="reset_mask"):
            env.reset(options={"reset_mask": mask})


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_an_action_that_is_no_number_names_its_row_and_changes_nothing(bad: float) -> None:
    env = gym.make_vec("icing_env/TwinOtter-v0", num_envs=4, mode="targets")
    env.reset(seed=1)
    before = env.unwrapped.save()
    action = np.zeros((4, 3), np.float32)
    action[2, 1] = bad
    with pytest.raises(InputError, match="row 2"):
        env.step(action)
    after = env.unwrapped.save()
    assert all(np.array_equal(before[k].view(np.uint8), after[k].view(np.uint8)) for k in before)


@pytest.mark.parametrize("action", [np.zeros(3, np.float32), np.zeros((1, 4), np.float32), 0.0], ids=["3", "1x4", "0"])
def test_an_action_of_the_wrong_shape_is_refused(action: Any) -> None:
    env = make()
    env.reset(seed=1)
    with pytest.raises(InputError, match="shape"):
        env.step(action)


@pytest.mark.parametrize(("changes", "message"), [
    ({"weathr": "clear"}, "did you mean 'weather'"),
    ({"task": {"kind": "hold", "climbrate": 3.0}}, "did you mean 'climb_rate'"),
    ({"parameters": {"turbulence_sigmaw": 1.0}}, "did you mean 'turbulence_sigma_w'"),
    ({"effects": {"wing_icing": {}}}, "did you mean 'wing_ice'"),
    ({"effects": {"wing_ice": {"ets": 0.1}}}, "did you mean 'eta'"),
    ({"initial": {"eta": {"leftwing": 0.1}}}, "did you mean 'left_wing'"),
    ({"weather": "stratifrom"}, "did you mean 'stratiform'"),
    ({"task": {"reward": {"altitud": 1.0}}}, "did you mean 'altitude'"),
])
def test_an_unknown_key_names_the_nearest_valid_one(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        make(changes=changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("options", OPTIONS[:3], ids=str)
def test_a_flight_goes_on_from_what_was_saved(options: dict[str, Any], tmp_path: Any) -> None:
    env = make(changes=icing(), **options)
    env.reset(seed=9)
    action = np.full(env.action_space.shape, 0.05, np.float32)
    for _ in range(80):
        env.step(action)
    np.savez(tmp_path / "saved.npz", **env.save())
    expected = [env.step(action)[0] for _ in range(80)][-1]
    other = make(changes=icing(), **options)
    other.reset(seed=123)
    with np.load(tmp_path / "saved.npz", allow_pickle=False) as saved:
        other.restore(dict(saved))
    assert np.array_equal([other.step(action)[0] for _ in range(80)][-1], expected)
    with pytest.raises(InputError, match="does not fit"):
        other.restore({"state": np.zeros(2)})


def test_a_thousand_steps_of_a_big_batch_in_everything_stay_within_bounds() -> None:
    scenario = scenarios.load("clear_air", **icing(duration=5.0))
    env = gym.make_vec("icing_env/TwinOtter-v0", num_envs=256, scenario=scenario, threads=2)
    env.reset(seed=0)
    rng = np.random.default_rng(1)
    for _ in range(300):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        seen, reward, _, _, _ = env.step(action)
        assert np.isfinite(reward).all() and (seen >= env.single_observation_space.low).all()
        assert (seen <= env.single_observation_space.high).all()
        assert np.isfinite(env.unwrapped.world.fleet.measurement["alpha"]).all()


def test_names_of_observation_and_action_fit_their_spaces() -> None:
    for name in IDS:
        for mode in ("surfaces", "targets"):
            env = make(name, mode=mode)
            assert len(env.observation_names) == len(set(env.observation_names)) == env.observation_space.shape[0]
            assert len(env.action_names) == env.action_space.shape[0]
            assert not any("true" in n or "eta" in n.split("_") for n in env.observation_names), "truth leaks"


def test_the_observation_holds_what_is_measured() -> None:
    env = make()
    seen, _ = env.reset(seed=1)
    m = env.world.fleet.measurement[0]
    for name in ("airspeed", "alpha", "theta", "az", "temperature"):
        assert seen[env.observation_names.index(name)] == np.float32(m[name])
    assert seen[env.observation_names.index("CL_alpha")] == pytest.approx(1.0)


def test_the_spec_survives_json() -> None:
    spec = gym.spec("icing_env/TwinOtterLateral-v0")
    assert gym.make(type(spec).from_json(spec.to_json()), disable_env_checker=True).unwrapped.world.axes == "lateral"


def test_stable_baselines_steps_the_batch() -> None:
    pytest.importorskip("stable_baselines3", reason="the extra `learning` is not installed")
    from testbed.sb3 import TwinOtterVecEnv

    env = TwinOtterVecEnv(3, mode="targets", changes={"duration": 0.2})
    env.seed(7)
    assert env.reset().shape == (3, *env.observation_space.shape)
    for _ in range(10):
        seen, reward, done, infos = env.step(np.zeros((3, 3), np.float32))
    assert done.all() and all(i["TimeLimit.truncated"] for i in infos) and reward.dtype == np.float32
    assert all(env.observation_space.contains(i["terminal_observation"]) for i in infos)
    assert not np.array_equal(seen[0], infos[0]["terminal_observation"])


def test_the_window_draws_without_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame", reason="the extra `render` is not installed")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(render_mode="human")
    env.reset(seed=1)
    env.step(np.zeros(4, np.float32))
    env.close()


def test_the_card_lists_every_channel_with_unit_and_bounds() -> None:
    text = (Path(__file__).parent.parent / "docs" / "environments.md").read_text()
    for i, c in enumerate(CHANNELS):
        assert f"| {i} | `{c.name}` | {c.unit} | {c.low:.4g} | {c.high:.4g} |" in text, c.name
    assert all(name in text for name in IDS) and all(f"| {task} |" in text for task in TASKS)


def test_a_scheduled_row_follows_its_own_clock_after_another_began_anew() -> None:
    changes = {"duration": 3.0, "cloud": [{"time": float(t), "lwc": 1e-4*t, "mvd": 2e-5, "temperature": 268.0}
                                          for t in range(4)]}
    options = {"num_envs": 2, "changes": changes, "autoreset_mode": "Disabled", "mode": "targets"}
    batch = gym.make_vec("icing_env/TwinOtter-v0", **options)
    batch.reset(seed=40)
    alone = make(changes=changes, mode="targets")
    alone.reset(seed=41)
    action = np.zeros((2, 3), np.float32)
    for step in range(149):
        if step == 27:  # row 0 begins anew in the middle of a second
            batch.reset(options={"reset_mask": np.array([True, False])})
        assert np.array_equal(batch.step(action)[0][1], alone.step(action[1])[0]), step
