"""Put trained policies among those that come with the project: `python -m testbed.training.ship RUNS`.

RUNS is a folder of run directories, as `testbed.training.batch` leaves it. Each policy takes its whole curve along.
"""

from __future__ import annotations

import json
from pathlib import Path

import click

from controllers.policies.files import FOLDER, read, write
from icing_env.errors import InputError


def ship(run: Path, folder: Path = FOLDER) -> Path:
    """Copy the best policy of a run, its card completed by the rest of the curve; returns the file.

    Raises:
        InputError: the run holds no whole policy or no curve.
    """
    network, tensors, card = read(run/"policy.safetensors")
    try:
        curve = json.loads((run/"curve.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as problem:
        raise InputError(f"{run}: no learning curve: {problem}") from None
    final = folder/f"{card['algorithm']}_{card['name']}_{card['seed']}.safetensors"
    write(final, network, tensors, card | {"curve": curve, "steps_learned": curve[-1]["steps"]})
    return final


@click.command()
@click.argument("runs", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=FOLDER, show_default=False,
              help="Folder of the policies; controllers/policies if omitted.")
@click.option("--least", type=int, default=0, help="Leave out runs that learned fewer steps.")
def main(runs: Path, out: Path, least: int) -> None:
    """Ship every run in RUNS that holds a policy."""
    for run in sorted(path for path in runs.iterdir() if (path/"policy.safetensors").is_file()):
        if json.loads((run/"curve.json").read_text(encoding="utf-8"))[-1]["steps"] >= least:
            click.echo(ship(run, out).name)


if __name__ == "__main__":
    main()
