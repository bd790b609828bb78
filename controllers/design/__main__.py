"""Command line of the offline designs: python -m controllers.design lqr|lqg|h_infinity --out FILE."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import click
from safetensors.numpy import save_file

from icing_env.errors import InputError


@click.command(epilog="Example: python -m controllers.design lqr --out configs/controllers/lqr.safetensors")
@click.argument("law", type=click.Choice(["lqr", "lqg", "h_infinity"]))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="file for the gains; none: report only")
def main(law: str, out: Path | None) -> None:
    """Design a law on the clean aircraft, report how robust it is, and write its gains."""
    module = import_module(f"controllers.design.{law}")
    tables, notes = module.design()
    click.echo("\n".join(notes))
    click.echo(import_module("controllers.design.robustness").report(law, tables))
    if out is not None:
        draft = out.with_suffix(".part")
        save_file(tables, draft, metadata={"command": f"python -m controllers.design {law} --out {out.name}"})
        draft.replace(out)


if __name__ == "__main__":
    try:
        main(standalone_mode=False)
    except (InputError, click.ClickException) as problem:
        print(f"controllers.design: {problem}", file=sys.stderr)
        sys.exit(2)
