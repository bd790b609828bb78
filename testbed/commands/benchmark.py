"""`icing benchmark`: how fast (`speed`)."""

from __future__ import annotations

import click

from testbed.commands.common import print_json, print_table, verb

NAMES = ("speed",)


@verb("benchmark", "icing benchmark speed\nicing benchmark speed --json")
@click.argument("name", type=click.Choice(NAMES))
def command(name: str, as_json: bool, seed: int) -> None:
    """Measure the testbed.

    `speed`: one aircraft and batches, with and without observer, one thread, beside JSBSim in the same run (if it is
    installed: the extra `peers`). Nothing is drawn at random; --seed changes nothing.
    """
    from testbed.speed import measure

    figures = measure(lambda what: click.echo(f"timing {what} ...", err=True))
    if as_json:
        print_json(figures)
        return
    rows = [[key.replace("_", " "), f"{figures[key]:.2f} us"]
            for key in ("physics_step_us", "env_step_us", "env_step_observed_us")]
    rows += [[f"H-infinity update, {k}", f"{v:.2f} us"] for k, v in figures["hinf_update_us"].items()]
    for key, label in (("batch_env_steps_per_s", "batch"), ("batch_observed_env_steps_per_s", "batch, observed")):
        rows += [[f"{label} of {n}", f"{rate:,.0f} steps/s"] for n, rate in figures[key].items()]
    peer = figures["peers"]["jsbsim_gym_like_step_us"]
    rows.append(["JSBSim, 4 writes, 2 runs, 15 reads", "not installed" if peer is None else f"{peer:.2f} us"])
    rows += [[key.replace("_", " "), "-" if ratio is None else f"{ratio:.1f}"]
             for key, ratio in figures["ratios"].items()]
    print_table(f"speed on one thread, {figures['machine']}", {"figure": "left", "value": "right"}, rows)
