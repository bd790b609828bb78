"""`icing effects`: the library of effects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from testbed.commands.common import own_effects, print_json, print_table, verb

if TYPE_CHECKING:
    from icing_env.effects.effect import Effect, Parameter


def as_record(effect: Effect) -> dict[str, Any]:
    """One effect as `--json` shows it."""
    keys = ("name", "component", "description", "parameters", "source")
    return {key: getattr(effect, key) for key in keys}


@verb("effects", "icing effects\nicing effects --json | jq '.[].name'")
@own_effects
def command(as_json: bool, seed: int) -> None:
    """List the ways in which an aircraft may differ from its model.

    Each effect has physical parameters, neutral by default: `icing fly --effect NAME:PARAMETER=VALUE` flies with it.
    Beside these, `discrepancy` flies what a diagnosis describes but cannot name (docs/model.md, section 20).
    Nothing is drawn at random here; --seed changes nothing.
    """
    from icing_env.effects import LIBRARY

    if as_json:
        print_json([as_record(effect) for effect in LIBRARY.values()])
        return
    headers = {"effect": "left", "component": "left", "typical (range)": "left", "what it is": "left"}
    rows = [[e.name, e.component, "\n".join(map(describe, e.parameters)), e.description] for e in LIBRARY.values()]
    print_table(f"{len(LIBRARY)} effects", headers, rows)


def describe(parameter: Parameter) -> str:
    """One parameter in a line: its typical value and its range."""
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{parameter.name} {parameter.typical:g}{unit} ({parameter.low:g} .. {parameter.high:g})"
