"""`icing train`: learn a controller."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from testbed.commands.common import print_json, verb


@verb("train", "icing train ppo --config targets_protected --out runs/ppo\nicing train ppo --resume runs/ppo")
@click.argument("algo", metavar="ALGO")
@click.option("--config", "name", help="An entry of configs/training/ALGO.yml; the first if omitted.")
@click.option("--scenario", help="Fly this scenario instead of the configuration's.")
@click.option("--steps", type=click.IntRange(min=1), help="Decisions to learn from; the configuration's if omitted.")
@click.option("--resume", type=click.Path(path_type=Path), help="Run directory to go on with, from its checkpoint.")
@click.option("--out", type=click.Path(path_type=Path), help="Run directory; runs/ALGO_CONFIG_SEED if omitted.")
@click.option("--threads", type=click.IntRange(min=1), default=1, show_default=True,
              help="Threads of PyTorch; a resumed run repeats itself only with the same number.")
@click.option("--minutes", type=click.FloatRange(min=0.0), help="Stop at a checkpoint after so many minutes.")
@click.option("--tensorboard", is_flag=True, help="Write files for TensorBoard, if it is installed.")
def command(algo: str, name: str | None, scenario: str | None, steps: int | None, resume: Path | None, out: Path | None,
            threads: int, minutes: float | None, tensorboard: bool, as_json: bool, seed: int) -> None:
    """Learn a controller: ppo, sac or recurrent_ppo.

    The run directory holds policy.safetensors (flown without PyTorch), last.safetensors, run.json (configuration and
    command), curve.csv and curve.json (flights of fixed cases as learning goes on) and the latest checkpoint. Learning
    can be killed at any moment; --resume goes on from the checkpoint, bit for bit as if nothing had happened.
    """
    from icing_env.errors import InputError
    from testbed.training import configuration as configurations
    from testbed.training.run import Order, begin, command_line, resumed

    try:
        import sb3_contrib  # noqa: F401
    except ImportError:
        raise InputError("training needs the extra `learning`: pip install 'icing-testbed[learning]'") from None
    if resume is not None:
        run = resumed(resume, threads=threads, tensorboard=tensorboard)
        if run.order.algorithm != algo:
            raise InputError(f"{resume}: holds a run of {run.order.algorithm}, not of {algo}")
    else:
        name, chosen = configurations.load(algo, name)
        if scenario is not None:
            chosen = configurations.on_scenario(chosen, scenario)
        total = steps or int(chosen.n_timesteps)
        order = Order(algo, name, chosen, seed, total, command_line(algo, name, seed, total, scenario))
        run = begin(order, out or Path("runs")/f"{algo}_{name}_{seed}", threads=threads, tensorboard=tensorboard)
    done = _learn(run, minutes)
    result = {"directory": run.folder, "finished": done, "steps": run.model.num_timesteps,
              "steps_in_all": run.order.steps, "curve": run.curve}
    if as_json:
        print_json(result)
        return
    last = run.curve[-1]
    click.echo(f"{run.folder}: {result['steps']:,} decisions, {result['steps_in_all']:,} asked for; rollouts are whole")
    click.echo(f"fixed cases: reward {last['reward']:.3f}, altitude {last['altitude_rms']:.2f} m, airspeed "
               f"{last['airspeed_rms']:.2f} m/s, losses {100*last['losses']:.1f} %")


def _learn(run: Any, minutes: float | None) -> bool:
    """Learn under a progress bar, if anyone is there to see it."""
    if not sys.stderr.isatty():
        return bool(run.learn(minutes))
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(20), MofNCompleteColumn(), TextColumn("decisions,"),
               TimeRemainingColumn(), TextColumn("to go"))
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("until the first point", total=run.order.steps, completed=run.model.num_timesteps)

        def show(steps: int, total: int, point: dict[str, float]) -> None:
            bar.update(task, completed=min(steps, total), total=total, description=f"reward {point['reward']:.3f}")

        return bool(run.learn(minutes, show))
