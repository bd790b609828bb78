"""`icing fly`: fly a scenario and write its record."""

from __future__ import annotations

from pathlib import Path

import click

from testbed.commands.common import own_effects, print_json, print_table, verb


@verb("fly", "icing fly clear_air --seed 1 --out a.csv\nicing fly stratiform --effect tail_ice:eta=0.1\n"
      "icing fly clear_air --effect wing_camera --effects-from examples/own_effect.py")
@click.argument("scenario")
@click.option("--controller", default="autopilot", show_default=True, help="Who flies.")
@click.option("--effect", "effects", multiple=True, metavar="NAME[:PARAM=VALUE,...]",
              help="An effect in the aircraft; repeat for several. Typical values without PARAM.")
@click.option("--duration", type=float, help="Seconds to fly instead of the scenario's.")
@click.option("--no-protection", is_flag=True, help="Without ice management and envelope protection.")
@click.option("--rate", type=float, help="Samples per second in the record; 50 if omitted.")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path),
              help="Record to write (.csv or .parquet); the truth goes beside it as NAME.truth.csv.")
@own_effects
def command(scenario: str, controller: str, effects: tuple[str, ...], duration: float | None, no_protection: bool,
            rate: float | None, out: Path | None, as_json: bool, seed: int) -> None:
    """Fly SCENARIO (a name, or the path of a .toml) and write the flight record.

    The record holds what instruments read and what was commanded; the truth is in a file of its own.
    """
    from controllers.ice_management import crew
    from icing_env.effects import parse
    from icing_env.scenario import load
    from testbed.flight import fly
    from testbed.flight_files import summary, write

    changes = {"effects": dict(map(parse, effects))} if effects else {}
    flight = fly(load(scenario, **changes, **({"duration": duration} if duration else {})), controller, seed,
                 protection=not no_protection, rate=rate)
    if out is not None:
        write(flight, out)
    figures = summary(flight)
    told = crew.log(flight.truth["time"], flight.advisory)
    if as_json:
        print_json({"scenario": scenario, "seed": seed, "record": out and str(out), **figures,
                    "crew": [{"time": t, "level": m.level, "text": m.text} for t, m in told]})
        return
    print_table(f"{scenario}, seed {seed}", {"figure": "left", "value": "right"},
                [[name.replace("_", " "), f"{value:.4g}" if isinstance(value, float) else str(value)]
                 for name, value in figures.items()])
    if told:
        print_table("what the crew was told", {"s": "right", "level": "left", "message": "left"},
                    [[f"{t:.0f}", m.level, m.text] for t, m in told])
    if out is not None:
        click.echo(f"record: {out}, truth: {out.with_suffix('.truth.csv')}")
