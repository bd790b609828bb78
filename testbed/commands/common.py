"""What every verb has in common: its options, and numbers as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import cleandoc
from pathlib import Path
from typing import Any

import click

Function = Callable[..., Any]


def verb(name: str, example: str, **settings: Any) -> Callable[[Function], click.Command]:
    """Make a verb of a function: its docstring is the help, `example` ends it, --json and --seed are added.

    The function receives `as_json` (bool) and `seed` (int) beside its own arguments.
    """

    def decorate(function: Function) -> click.Command:
        text = f"{cleandoc(function.__doc__ or '')}\n\n\b\nExample:\n  " + example.replace("\n", "\n  ")
        options = (
            click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on standard output."),
            click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True,
                         help="Seed of all random draws: the same seed, the same result."),
        )  # fmt: skip
        for option in reversed(options):
            function = option(function)
        return click.command(name, help=text, **settings)(function)

    return decorate


class Listing(click.Command):
    """A verb whose repeated options of files may also be given once, with all that they list behind: `--held-out A B`.

    Only behind a first RECORD, lest `--held-out A RECORD` leaves none.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option before each of its files."""
        lists = {name for p in self.params if isinstance(p, click.Option) and p.metavar == "RECORD" for name in p.opts}
        return super().parse_args(ctx, repeated(args, lists))


def repeated(args: list[str], lists: Collection[str]) -> list[str]:
    """Arguments in which every file behind an option of `lists` has that option before it."""
    if not args or args[0].startswith("-"):
        return args
    out, option, first = list[str](), "", False
    for word in args:
        if word.startswith("-"):
            option, first = word if word in lists else "", True
        elif option and not first:
            out.append(option)
        else:
            first = False
        out.append(word)
    return out


def own_effects(function: Function) -> Function:
    """Add --effects-from to a verb: effects of the user's own are in the library when its function runs.

    What installed packages announce is there too; the function itself receives nothing of this.
    """

    @wraps(function)
    def prepared(*args: Any, effects_from: tuple[Path, ...], **options: Any) -> Any:
        from icing_env.effects import own

        own.from_packages()
        for path in effects_from:
            own.from_file(path)
        return function(*args, **options)

    return click.option("--effects-from", multiple=True, metavar="FILE.py", type=click.Path(path_type=Path),
                        help="Effects of your own, as in examples/own_effect.py. May be repeated.")(prepared)


def plain(value: Any) -> Any:
    """`value` in JSON's types: arrays as lists, dataclasses as objects, numbers that are not finite as null.

    Raises:
        TypeError: there is no such form.
    """
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if hasattr(value, "tolist"):  # NumPy's arrays and scalars, without importing NumPy for verbs that need none
        return plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"no JSON form for {type(value).__name__}")


def print_json(value: Any) -> None:
    """Print `value` as JSON on standard output."""
    click.echo(json.dumps(plain(value), indent=2, allow_nan=False, ensure_ascii=False))


def print_table(title: str, headers: Mapping[str, str], rows: list[list[str]]) -> None:
    """Print a table on standard output.

    Args:
        title: stands above it.
        headers: "left" or "right" (how the column is set) by heading, in order.
        rows: cells as text.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    for heading, side in headers.items():
        table.add_column(heading, justify="right" if side == "right" else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    console = Console()
    console.width = console.width if console.is_terminal else 120  # a pipe has no width; 80 would fold every row
    console.print(Text(title, style="italic"))  # a title of the table's own would be folded to the table's width
    console.print(table)
