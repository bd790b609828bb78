"""What a planned flight would reveal, for people and machines: the part of `icing diagnose` that needs no record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from icing_env.errors import InputError
from testbed.commands.common import Function, print_json, print_table

if TYPE_CHECKING:
    from sim2real.planning.plan import Plan

MOST_NAMED = 3  # effects that one would be taken for, in the table; --json has all
OF_RECORDS = {"records": "RECORD", "held_out": "--held-out", "reference": "--reference", "out": "--out",
              "ladder": "--ladder", "simulator": "--simulator", "policies": "--policies"}  # fmt: skip
OPTIONS = (
    click.option("--plan", "planned", multiple=True, metavar="MANOEUVRE",
                 help="Without a RECORD: what a manoeuvre would reveal before it is flown, such as "
                      "'elevator doublets at 55 m/s', or `all` of the list. May be repeated."),
    click.option("--gusts", type=click.FloatRange(min=0.0), help="Of the plan: intensity in m/s; 0.5 if omitted."),
    click.option("--altitude", type=click.FloatRange(0.0, 9000.0), help="Of the plan: m; 2200 if omitted."),
    click.option("--amplitude", type=click.FloatRange(0.0, min_open=True),
                 help="Of the plan: how large the inputs are, times those of the list."),
    click.option("--noise", multiple=True, metavar="CHANNEL=VALUE",
                 help="Of the plan: a standard deviation (SI) that is not the instruments' own. May be repeated."),
)  # fmt: skip


def before_a_flight(function: Function) -> Function:
    """Add --plan and what belongs to it to a verb: with --plan it is answered here, the function is not called."""

    @wraps(function)
    def either(*args: Any, planned: tuple[str, ...], gusts: float | None, altitude: float | None,
               amplitude: float | None, noise: tuple[str, ...], **options: Any) -> Any:
        expected = {"--gusts": gusts, "--altitude": altitude, "--amplitude": amplitude, "--noise": noise or None}
        if not planned:
            for name, value in expected.items():
                if value is not None:
                    raise InputError(f"{name} belongs to a plan: name a manoeuvre with --plan, or leave it out")
            return function(*args, **options)
        for name, written in OF_RECORDS.items():
            if options[name]:
                raise InputError(f"--plan is for before the flight and takes no {written}: leave out one of them")
        return show_plan(planned, options["without"], options["as_json"], gusts, altitude, amplitude, noise)

    for option in reversed(OPTIONS):
        either = option(either)
    return either


def show_plan(names: tuple[str, ...], without: tuple[str, ...], as_json: bool, gusts: float | None,
              altitude: float | None, amplitude: float | None, noise: tuple[str, ...]) -> None:
    """Plan, and print the smallest size of every effect that manoeuvres nobody has flown would reveal.

    Args:
        names: of the manoeuvres; "all" for every one of the list.
        without: effects to leave out.
        as_json: print JSON and nothing else.
        gusts, altitude, amplitude: m/s, m, times that of the list; the usual ones if None.
        noise: "CHANNEL=VALUE", standard deviations that are not the instruments' own.

    Raises:
        InputError: one of them makes no sense.
    """
    from rich.console import Console

    from sim2real.planning.plan import ALTITUDE, GUSTS, plan
    from sim2real.planning.planned import named

    with Console(stderr=True).status("planning") as status:
        found = plan(named(names, 1.0 if amplitude is None else amplitude), GUSTS if gusts is None else gusts,
                     noise_of(noise), without, ALTITUDE if altitude is None else altitude, status.update)  # fmt: skip
    if as_json:
        print_json(asdict(found))
    else:
        _show(found)


def noise_of(items: Iterable[str]) -> dict[str, float]:
    """Standard deviation by channel from "CHANNEL=VALUE".

    Raises:
        InputError: that is not its form.
    """
    out = {}
    for item in items:
        name, _, value = item.partition("=")
        try:
            out[name] = float(value)
        except ValueError:
            raise InputError(f"--noise '{item}': expected CHANNEL=VALUE in SI units, as in q=0.002") from None
    return out


def _show(found: Plan) -> None:
    """Three plain sentences, then the evidence as tables."""
    limits, missed = found.detection_limits, found.not_testable
    typical = [n for n in limits if n in found.indistinguishable_from]
    alone = [n for n in typical if not found.indistinguishable_from[n]]
    flown = ", ".join(f"'{m['name']}'" for m in found.manoeuvres)
    click.echo(f"Flown at {found.altitude:g} m in gusts of {found.sigma_w:g} m/s, {flown} would show {len(typical)} of "
               f"{len(limits) + len(missed)} effects at their typical size, {len(limits) - len(typical)} only larger, "
               f"{len(missed)} at none.")  # fmt: skip
    click.echo(f"Of those {len(typical)} they would tell {len(alone)} apart from every other single effect.")
    click.echo("Gusts count as noise here; what gusts themselves shake may show sooner.")
    for why in found.refused.values():
        click.echo(f"Left out: {why}")
    click.echo()
    headers = {"effect": "left", "parameter": "left", "smallest shown": "right", "typical": "right", "unit": "left",
               "at typical size taken for": "left"}  # fmt: skip
    order = sorted(limits, key=lambda n: (n not in found.indistinguishable_from,
                                          abs(limits[n]["smallest"] / limits[n]["typical"])))  # fmt: skip
    print_table("Detection limits before the flight", headers, [_row(n, limits[n], found) for n in order])
    click.echo()
    print_table("Not shown at any size", {"effect": "left", "why": "left"}, [[m["effect"], m["why"]] for m in missed])


def _row(name: str, limit: dict[str, Any], found: Plan) -> list[str]:
    unit = "" if limit["unit"] == "1" else limit["unit"]
    near = found.indistinguishable_from.get(name)
    if near is None:
        told = "would not show at typical size"
    else:
        more = f" and {len(near) - MOST_NAMED} more" if len(near) > MOST_NAMED else ""
        told = ", ".join(near[:MOST_NAMED]) + more
    return [name, limit["parameter"], f"{limit['smallest']:.3g}", f"{limit['typical']:.3g}", unit, told]
