"""Aircraft, task and loop together: what the environments, the command line and the experiments all step.

`World` holds `n` episodes of one scenario in arrays. It knows nothing of Gymnasium.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import actions, aircraft, effects
from icing_env import scenario as scenarios
from icing_env.accretion import glaze_of
from icing_env.conclude import conclude, look
from icing_env.errors import InputError
from icing_env.jit import bound, compile_beside, compiles_beside
from icing_env.loop import LoopFactory, NoLoop
from icing_env.manoeuvres import excite, schedule
from icing_env.memory import call_at
from icing_env.observation import Axes, Observation
from icing_env.scenario import Range, Scenario
from icing_env.simulate import Fleet
from icing_env.tasks import TASK, TASKS, refer_rows
from icing_env.trim import conditions, trim_rows
from icing_env.types import COMMAND, SURFACES


class World:
    """Episodes of a scenario.

    Args:
        scenario: of `scenario.load`.
        n: number of aircraft.
        loop: makes what closes the loop; nobody if omitted.
        mode: what an action means, of `actions.NAMES`; None: the autopilot flies the task, there is no action.
        axes: which axes the action covers.
        threads, dt, substeps: as in `Fleet`.
    """

    def __init__(self, scenario: Scenario, n: int = 1, loop: LoopFactory = NoLoop, *,
                 mode: actions.Mode | None = None, axes: Axes = "all", threads: int = 1, dt: float = 0.02,
                 substeps: int = 2) -> None:
        self.scenario, self.n, self.dt, self.mode, self.axes = scenario, n, dt, mode, axes
        self.clean, self.true = scenario.clean_parameters(), scenario.true_parameters()
        draws = scenario.randomise
        self.individual = bool(draws.parameters or draws.effects)
        parameters = aircraft.broadcast(self.true, n) if self.individual else self.true
        compile_beside("icing_env.world")
        self.fleet = Fleet(parameters, n, dt, substeps, threads)
        self._fly = self.fleet.step if compiles_beside() else self.fleet.bind()
        self.loop = loop(n, self.clean, dt)
        self.loop.attach(self.fleet.measurement, self.fleet.command)
        self.task, self.trimmed, self.weights = np.zeros(n, TASK), np.zeros(n, COMMAND), scenario.weights()
        self.seed, self.episode = np.zeros(n, np.uint64), np.zeros(n, np.int64)
        self.limit = round(scenario.duration/dt)
        self.doublets = schedule(scenario.doublets())
        self.clean_estimate = self.loop.estimate[:1].copy()
        self.view = Observation(axes, n, TASK, self.clean_estimate)
        self.action = np.zeros((n, len(actions.names(mode, axes)) if mode else 0), np.float32)
        self.scheduled = bool(scenario.cloud or scenario.events)
        self._shape = self.action.shape
        self._bind(mode, axes)

    def _bind(self, mode: actions.Mode | None, axes: Axes) -> None:
        f, loop, v = self.fleet, self.loop, self.view
        seen = (f.measurement, self.task, loop.estimate, loop.advisory, v.layout, v.scaling, v.out)
        self._conclude = call_at(conclude, *seen, loop.target, self.weights, f.state, f.outcome, f.current, f.command,
                                 f.parameters)
        self._look = call_at(look, *seen)
        self._excite = bound(excite, f.command, f.measurement, self.doublets) if len(self.doublets) else None
        columns = actions.columns(mode or "surfaces", axes)
        # what an action does at once, and what it does after the autopilot has flown the axes that it leaves open
        self._accept = self._overlay = None
        if mode == "targets":
            self._accept = call_at(actions.to_targets, self.action, columns, self.task, loop.target)
        elif mode == "limits":
            self._accept = call_at(actions.to_limits, self.action, columns, loop.advisory)
        elif mode == "surfaces":
            act = call_at(actions.to_surfaces, self.action, columns, self.trimmed, f.command)
            checked = call_at(actions.check, self.action, columns)
            self._accept, self._overlay = (act, None) if axes == "all" else (checked, act)
        self._steer, self._protect, self._observe = loop.steer, loop.protect, loop.observe
        self._steered = mode != "surfaces" or axes != "all"

    def reset(self, rows: NDArray | None = None, seeds: Sequence[int] | None = None,
              initial: dict[str, Any] | None = None) -> None:
        """Begin new episodes.

        Args:
            rows: which aircraft; all if omitted.
            seeds: a new seed for each; without, the next episode of the seed it has.
            initial: fields of the scenario's `initial` to use instead, `eta` by surface included.
        """
        rows = np.arange(self.n) if rows is None else np.asarray(rows)
        if seeds is not None:
            self.seed[rows], self.episode[rows] = np.asarray(seeds, np.uint64), 0
        else:
            self.episode[rows] += 1
        condition = conditions(len(rows))
        eta = np.zeros((len(rows), len(SURFACES)))
        for j, i in enumerate(rows):
            self._draw(int(i), j, condition, eta, initial or {})
        self._place(rows, condition, eta)

    def _draw(self, i: int, j: int, condition: NDArray, eta: NDArray, initial: dict[str, Any]) -> None:
        """What is random about the episode of row `i`, from its own stream."""
        rng = np.random.Generator(np.random.Philox(key=np.array([self.seed[i], self.episode[i]], np.uint64)))
        self.fleet.state["seed"][i] = rng.integers(2**63, dtype=np.uint64)
        start, draws = self.scenario.initial, self.scenario.randomise
        for name in ("airspeed", "altitude", "heading", "flap"):
            value = getattr(start, name)
            if name in draws.initial:
                value = _uniform(rng, draws.initial[name])  # type: ignore[index]
            condition[name][j] = initial.get(name, value)
        for k, surface in enumerate(SURFACES):
            value = start.eta.get(surface, 0.0)
            if surface in draws.eta:
                value = _uniform(rng, draws.eta[surface])
            eta[j, k] = initial.get("eta", {}).get(surface, value)
        if self.individual:
            changes = {name: _uniform(rng, span) for name, span in draws.parameters.items()}
            drawn = {e: {p: _uniform(rng, span) for p, span in spans.items()} for e, spans in draws.effects.items()}
            self.fleet.parameters[i] = effects.with_effects(aircraft.changed(self.true, **changes), drawn)[0]

    def _place(self, rows: NDArray, condition: NDArray, eta: NDArray) -> None:
        """Trim the rows in their conditions and settle everything on them."""
        f, seeds = self.fleet, self.fleet.state["seed"][rows].copy()
        state, command, current = np.zeros_like(f.state[rows]), np.zeros_like(f.command[rows]), f.current[rows]
        parameters = f.parameters if len(f.parameters) == 1 else f.parameters[rows]
        for k, surface in enumerate(SURFACES):
            thickness, mass = glaze_of(eta[:, k], parameters, surface)
            state[f"eta_{surface}"], state[f"thickness_{surface}"] = eta[:, k], thickness
            state[f"ice_mass_{surface}"] = mass
        left_over = trim_rows(state, current, command, condition, parameters)
        if not np.all(np.isfinite(left_over)):
            raise InputError(f"scenario '{self.scenario.name}': no steady flight at the start: less ice or more speed")
        for name in ("throttle_left", "throttle_right"):
            command[name] = np.clip(command[name], 0.0, 1.0)
        state["seed"] = seeds
        f.state[rows], f.command[rows], self.trimmed[rows] = state, command, command
        self.task["steps"][rows] = 0.0
        self._follow_schedule(rows)
        f.start(rows)
        k = self.task[rows]
        k[:] = 0
        k["limit"] = self.limit
        k["kind"] = TASKS.index(self.scenario.task.kind)
        k["start_altitude"], k["start_heading"] = f.measurement["altitude"][rows], condition["heading"]
        k["start_airspeed"] = condition["airspeed"]
        self._settings(k)
        for surface in ("elevator", "aileron", "rudder"):
            k[f"{surface}_before"] = command[surface]
        self.task[rows] = k
        self.loop.reset(rows)
        target = self.loop.target[rows]
        refer_rows(k, target, f.measurement[rows])
        self.task[rows], self.loop.target[rows] = k, target
        self._look()

    def _settings(self, k: NDArray) -> None:
        """Numbers of the task that do not change within an episode."""
        task = self.scenario.task
        k["climb"] = task.climb_rate if task.kind == "climb" else 0.0
        if task.kind == "approach":
            k["climb"] = -np.tan(task.glide_angle)*k["start_airspeed"]
        k["slow_to"], k["full_flap"], k["leg_time"] = task.slow_to, task.full_flap, task.leg_time

    def _follow_schedule(self, rows: NDArray) -> None:
        """Prescribed cloud and scheduled ice protection for the time it is in each of `rows`."""
        cloud, events, f = self.scenario.cloud, self.scenario.events, self.fleet
        for count in np.unique(self.steps[rows]) if cloud or events else ():
            now, due = count*self.dt + 1e-9, rows[self.steps[rows] == count]
            for point in [p for p in cloud if p.time <= now][-1:]:
                f.state["lwc"][due], f.state["mvd"][due] = point.lwc, point.mvd
                f.state["temperature"][due] = point.temperature
            if events:
                shots = {boot for e in events if 0.0 <= now - e.time < 1.0 for boot in e.boots}
                for boot in ("wing", "tail", "vtail_struts"):
                    f.command[f"boots_{boot}"][due] = float(boot in shots)
            for event in [e for e in events if e.prop_heat is not None and e.time <= now][-1:]:
                f.command["prop_heat"][due] = float(bool(event.prop_heat))

    def step(self, action: NDArray | None = None) -> None:
        """One step of every aircraft.

        Args:
            action: [n, actions] in [-1, 1], or None to let the last one stand (or the autopilot fly).

        Raises:
            InputError: an action that is not finite (its row is named, nothing has changed) or of the wrong shape.
        """
        if self._accept is not None:
            self._take(action)
        if self.scheduled:
            self._follow_schedule(np.flatnonzero(self.steps % self.fleet.clock["one_hertz"][0] == 0.0))
        if self._steered:
            self._steer()
        if self._overlay is not None:
            self._overlay()
        if self._excite is not None:
            self._excite()
        self._protect()
        self._fly()
        self._observe()
        self._conclude()

    def _take(self, action: NDArray | None) -> None:
        """Store the action, check it and act on it at once as far as that is its own."""
        if action is not None:
            if getattr(action, "shape", None) != self._shape:
                raise InputError(f"action must have shape {self._shape} ({', '.join(self.action_names)}), "
                                 f"got {np.shape(action)}")
            self.action[:] = action
        bad = self._accept() if self._accept else -1
        if bad >= 0:
            raise InputError(f"action of row {bad} is not finite: {self.action[bad].tolist()}; "
                             "every value must be a number in [-1, 1]")

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the actions, in order."""
        return actions.names(self.mode, self.axes) if self.mode else ()

    @property
    def observation(self) -> NDArray[np.float32]:
        """Observations [n, channels]; the array is written anew in each step."""
        return self.view.out

    def frame(self, row: int) -> NDArray[np.uint8]:
        """Primary flight display of one aircraft, [height, width, 3]; what its instruments and advisers say."""
        from icing_env.display import DisplayView, draw

        clean, target = self.clean_estimate[0], self.loop.target[row]
        view = DisplayView.from_rows(
            self.fleet.measurement[row], self.loop.advisory[row], self.loop.estimate[row],
            (float(clean["CL_alpha"]) or 1.0, float(clean["Cm_alpha"]) or 1.0), float(self.clean["alpha_stall"][0]),
            (float(target["airspeed"]), float(target["altitude"]), float(target["heading"])))
        return draw(view)

    @property
    def steps(self) -> NDArray[np.float64]:
        """Steps flown in each episode [n]."""
        return self.task["steps"]

    @property
    def terminated(self) -> NDArray[np.bool_]:
        """Which episodes ended in ground contact, structural failure or upset [n]."""
        return self.task["reason"] > 0.0

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """Which episodes reached the end of their time [n]."""
        return self.task["truncated"] > 0.0

    def _arrays(self) -> dict[str, NDArray]:
        f = self.fleet  # parameters without their names, which are more than `numpy.load` takes for safe
        numbers = f.parameters.view(np.float64).reshape(len(f.parameters), -1)
        return {"state": f.state, "measurement": f.measurement, "current": f.current, "command": f.command,
                "outcome": f.outcome, "parameters": numbers, "task": self.task, "trimmed": self.trimmed,
                "seed": self.seed, "episode": self.episode, "observation": self.view.out,
                **{f"loop_{name}": array for name, array in self.loop.memory().items()}}

    def save(self) -> dict[str, NDArray]:
        """Copy of everything that decides how the flight goes on; plain arrays, fit for `numpy.savez`."""
        return {name: array.copy() for name, array in self._arrays().items()}

    def restore(self, saved: dict[str, NDArray]) -> None:
        """Go on from a `save` of a world of the same scenario and size.

        Raises:
            InputError: arrays are missing or of another shape or type.
        """
        for name, array in self._arrays().items():
            if name not in saved or saved[name].shape != array.shape or saved[name].dtype != array.dtype:
                must = f"{array.dtype.name} of shape {array.shape}"
                raise InputError(f"saved state does not fit: '{name}' must be {must}")
        for name, array in self._arrays().items():
            array[...] = saved[name]


def _uniform(rng: np.random.Generator, span: Range) -> float:
    return float(rng.uniform(span.low, span.high))


if __name__ == "__main__":  # see `icing_env.jit.compile_beside`
    World(scenarios.load("clear_air"), mode="surfaces").reset(seeds=[0])
