"""`icing characterise`: ice by surface from flight records, and the training of what judges it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from testbed.commands.common import print_json, print_table, verb

EXAMPLE = """icing characterise flight.csv --reference clean.csv
icing characterise flight.csv --rival logistic --json
icing characterise --train --out out/characterise"""


@verb("characterise", EXAMPLE)
@click.argument("records", nargs=-1, metavar="RECORD...", type=click.Path(path_type=Path))
@click.option("--reference", type=click.Path(path_type=Path), help="Clean flight of the same aircraft: doublets, calm.")
@click.option("--rival", default="network", show_default=True, help="threshold, logistic or network.")
@click.option("--weights", type=click.Path(path_type=Path), help="Folder of a training; else what comes along.")
@click.option("--train", is_flag=True, help="Fly, fit, calibrate and set thresholds instead; goes on if it was killed.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/characterise"), show_default=True,
              help="Folder of the training.")  # fmt: skip
@click.option("--aircraft", type=click.IntRange(min=20), default=1000, show_default=True,
              help="Training: aircraft of each of four sorts in each part.")  # fmt: skip
@click.option("--parts", type=click.IntRange(min=1), default=4, show_default=True, help="Training: parts.")
@click.option("--hours", type=click.FloatRange(min=0.5), default=100.0, show_default=True,
              help="Training: clear air per class of turbulence.")  # fmt: skip
def command(records: tuple[Path, ...], reference: Path | None, rival: str, weights: Path | None, train: bool,
            out: Path, aircraft: int, parts: int, hours: float, as_json: bool, seed: int) -> None:
    """Tell the ice on each surface from flight records: severity, onset, and whether the ice protection works.

    A record needs airspeed, flow angles, rates, attitude, accelerations, surfaces and thrust. Without --reference the
    aircraft is known by its type only. --seed matters to --train alone.
    """
    from icing_env.errors import InputError

    if train:
        from testbed.characterisation.train import Options
        from testbed.characterisation.train import train as run

        card = run(out, Options(aircraft, parts, hours, seed=seed), lambda line: click.echo(line, err=True))
        if as_json:
            print_json(card)
        else:
            click.echo(f"wrote {out}: {', '.join(sorted(p.name for p in out.iterdir() if p.is_file()))}")
        return
    if not records:
        raise InputError("characterise: give a record, or --train")
    found = answer(records, reference, rival, weights)
    if as_json:
        print_json(found)
        return
    for path, one in found["records"].items():
        _print(path, one)


def answer(records: tuple[Path, ...], reference: Path | None, rival: str, weights: Path | None) -> dict[str, Any]:
    """What `--json` prints: for each record severity, classes, onset, protection."""
    from estimators.characterise.record import characterise
    from icing_env.record import read

    clean = None if reference is None else read(reference)
    return {"rival": rival, "reference": None if reference is None else str(reference),
            "records": {str(path): characterise(read(path), clean, rival, weights) for path in records}}


def _print(path: str, found: dict[str, Any]) -> None:
    rows = [[part.replace("_", " "), f"{s['eta']:.3f}", f"{s['std']:.3f}", f"{s['probability']:.2f}", s["protection"],
             "-" if s["inflations"] == 0 else f"{s['probability_failed']:.2f}"]
            for part, s in found["surfaces"].items()]
    headers = {"surface": "left", "severity": "right", "std": "right", "P(iced)": "right", "protection": "left",
               "P(failed)": "right"}
    print_table(path, headers, rows)
    likely = max(found["classes"], key=found["classes"].get)
    click.echo(f"ice {'detected' if found['detected'] else 'not detected'}"
               + ("" if found["onset"] is None else f", since {found['onset']:.0f} s")
               + f"; P(ice matters) {found['probability']:.3f}; if on one surface alone: {likely.replace('_', ' ')} "
               f"({found['classes'][likely]:.2f}); gusts {found['gust']:.1f} m/s")
    for line in found["notes"]:
        click.echo(f"note     {line}")
