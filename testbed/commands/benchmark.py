"""`icing benchmark`: how fast (`speed`), how well ice is told (`characterisation`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from testbed.commands.common import print_json, print_table, verb

NAMES = ("speed", "characterisation")
EXAMPLE = """icing benchmark speed --json
icing benchmark characterisation --quick --figure out/reliability.png"""


@verb("benchmark", EXAMPLE)
@click.argument("name", type=click.Choice(NAMES))
@click.option("--quick", is_flag=True, help="characterisation: few flights, to see that it works.")
@click.option("--weights", type=click.Path(path_type=Path), help="characterisation: folder of a training.")
@click.option("--figure", type=click.Path(path_type=Path), help="characterisation: reliability curves as PNG.")
def command(name: str, quick: bool, weights: Path | None, figure: Path | None, as_json: bool, seed: int) -> None:
    """Measure the testbed.

    `speed`: one aircraft and batches, with and without observer, one thread, beside JSBSim in the same run (if it is
    installed: the extra `peers`). `characterisation`: classes, detection, false alarms, protection, reliability, on
    flights that no fit has seen. Seeds are fixed in the code, apart from those of the training; --seed changes nothing.
    """
    if name == "speed":
        _speed(as_json)
        return
    from testbed.characterisation.benchmark import draw, measure, tables

    found = measure(quick, weights, lambda what: click.echo(f"{what} ...", err=True))
    if figure is not None:
        draw(found, figure)
    if as_json:
        print_json(found)
        return
    for title, headers, rows in tables(found):
        print_table(title, headers, rows)


def _speed(as_json: bool) -> None:
    from testbed.speed import measure

    figures = measure(lambda what: click.echo(f"timing {what} ...", err=True))
    if as_json:
        print_json(figures)
        return
    rows: list[list[Any]] = [[key.replace("_", " "), f"{figures[key]:.2f} us"]
                             for key in ("physics_step_us", "env_step_us", "env_step_observed_us")]
    rows += [[f"H-infinity update, {k}", f"{v:.2f} us"] for k, v in figures["hinf_update_us"].items()]
    for key, label in (("batch_env_steps_per_s", "batch"), ("batch_observed_env_steps_per_s", "batch, observed")):
        rows += [[f"{label} of {n}", f"{rate:,.0f} steps/s"] for n, rate in figures[key].items()]
    peer = figures["peers"]["jsbsim_gym_like_step_us"]
    rows.append(["JSBSim, 4 writes, 2 runs, 15 reads", "not installed" if peer is None else f"{peer:.2f} us"])
    rows += [[key.replace("_", " "), "-" if ratio is None else f"{ratio:.1f}"]
             for key, ratio in figures["ratios"].items()]
    print_table(f"speed on one thread, {figures['machine']}", {"figure": "left", "value": "right"}, rows)
