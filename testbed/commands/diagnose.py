"""`icing diagnose`: where a simulator and an aircraft part, which effect causes it, how far the gap closes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from icing_env.errors import InputError
from testbed.commands.common import Listing, own_effects, print_json, print_table, verb
from testbed.planning import before_a_flight

if TYPE_CHECKING:
    from icing_env.record import FlightRecord
    from sim2real.diagnosis import Diagnosis

EXAMPLE = """icing diagnose flown.csv --held-out other.csv --out out/diagnosis
icing fly clear_air --seed 1 --effect elevator_power:change=-0.2 --out flown.csv
icing fly clear_air --seed 2 --effect elevator_power:change=-0.2 --out other.csv
icing diagnose --plan "elevator doublets at 55 m/s" --gusts 1.5"""
RECORDS = click.Path(path_type=Path)


@verb("diagnose", EXAMPLE, cls=Listing)
@click.argument("records", nargs=-1, metavar="RECORD...", type=RECORDS)
@click.option("--held-out", multiple=True, metavar="RECORD", type=RECORDS,
              help="Never fitted: how far the gap closes is measured on it. May be repeated or list several.")
@click.option("--reference", multiple=True, metavar="RECORD", type=RECORDS,
              help="The same aircraft without the gap: corrects the model first. May be repeated or list several.")
@click.option("--without", multiple=True, metavar="EFFECT", help="Leave an effect out of the library. May be repeated.")
@click.option("--out", metavar="DIR", type=click.Path(path_type=Path, file_okay=False),
              help="Write diagnosis.json and report.html there.")  # fmt: skip
@click.option("--ladder", is_flag=True,
              help="Also close the gap by a rival, by a regression without physics, and where there is none.")
@click.option("--simulator", metavar="FILE.py", type=click.Path(path_type=Path),
              help="A simulator of your own in the place of ours, as in examples/own_simulator.py.")
@click.option("--policies", is_flag=True,
              help="Also rank controllers by the simulator before and after, and on the aircraft as diagnosed.")
@own_effects
@before_a_flight
def command(records: tuple[Path, ...], held_out: tuple[Path, ...], reference: tuple[Path, ...],
            without: tuple[str, ...], out: Path | None, ladder: bool, simulator: Path | None, policies: bool,
            as_json: bool, seed: int) -> None:
    """Say where the model and the aircraft that flew RECORD part, and which unmodelled effect causes it.

    Records are .csv, .parquet or SIDPAC's .mat. Every effect of `icing effects` is tried, beside "no gap" and "nothing
    in the library"; effects that the records cannot tell apart are named together. Names and notes of files play no
    part; a RECORD whose side file has the role "held_out" or "reference" is taken as that. With --plan no RECORD is
    needed: it says what manoeuvres would reveal before they are flown.
    """
    from rich.console import Console

    from sim2real.diagnosis import diagnose
    from sim2real.rollout import from_file
    from testbed.memory import keep_freed_memory

    keep_freed_memory()
    if not records:
        raise InputError("no RECORD to diagnose: give at least one, or a manoeuvre with --plan")
    shown, unseen, clean = by_role(records)
    with Console(stderr=True).status("reading the records") as status:
        own = None if simulator is None else from_file(simulator)
        found = diagnose(shown, [*unseen, *read_all(held_out)], [*clean, *read_all(reference)], without, seed,
                         status.update, climb=ladder, simulator=own)  # fmt: skip
        result = answer(found)
        if policies:
            result["policies"] = rank_policies(result, seed, status.update)
    if out is not None:
        from testbed.reports.diagnosis import write_report

        write_report(found, result, out)
    if as_json:
        print_json(result)
        return
    show(found, result)
    if policies:
        show_policies(result["policies"])
    click.echo(cost(result["seconds"]))
    if out is not None:
        click.echo(f"report: {out / 'report.html'}")


def cost(seconds: float) -> str:
    """What a diagnosis took."""
    from testbed.memory import peak_memory_gb

    memory = peak_memory_gb()
    return f"Took {seconds:.0f} s" + ("." if memory is None else f" and {memory:.1f} GB of memory at most.")


def rank_policies(result: dict[str, Any], seed: int, say: Callable[[str], None]) -> dict[str, Any] | None:
    """How the diagnosed effects change the ranking of controllers; None where no effect is diagnosed."""
    from testbed import policy_gap

    wide, diagnosed = policy_gap.intervals(result)
    if not diagnosed:
        return None
    say("ranking controllers before and after")
    return policy_gap.rank(wide, diagnosed, seed=seed, workers=2)


def show_policies(found: dict[str, Any] | None) -> None:
    """The table of ranks."""
    from testbed import policy_gap

    click.echo()
    if found is None:
        click.echo("Policies: no effect is diagnosed, so the simulator ranks controllers as before.")
        return
    print_table(f"{len(found['controllers'])} controllers ranked by the simulator, and on the aircraft as diagnosed",
                *policy_gap.rows(found))
    for sentence in policy_gap.sentences(found):
        click.echo(sentence)


def read_all(paths: tuple[Path, ...]) -> list[FlightRecord]:
    """Records of the given files."""
    from icing_env.record import read

    return [read(path) for path in paths]


def by_role(paths: tuple[Path, ...]) -> tuple[list[FlightRecord], list[FlightRecord], list[FlightRecord]]:
    """Records to diagnose, those held out and the references, as the side files of the given ones have it.

    Raises:
        InputError: none is left to diagnose.
    """
    given = read_all(paths)
    shown, unseen, clean = ([r for r in given if r.meta.role == role] for role in ("diagnose", "held_out", "reference"))
    if not shown:
        raise InputError(f"{paths[0].with_suffix('.toml')}: role is '{given[0].meta.role}', and none of the given "
                         'records has the role "diagnose": give one that has, or has none')
    return shown, unseen, clean


def answer(found: Diagnosis) -> dict[str, Any]:
    """The diagnosis as JSON fixes it."""
    from dataclasses import fields

    return {f.name: getattr(found, f.name) for f in fields(found) if f.metadata.get("json", True)}


def show(found: Diagnosis, result: dict[str, Any]) -> None:
    """The verdict in plain sentences, then the evidence as tables."""
    from sim2real.words import of_the_model, sentences
    from testbed.reports.given import taken_as_given

    for sentence in sentences(found):
        click.echo(sentence)
    headers = {"explanation": "left", "probability": "right", "parameter": "left", "estimate": "right",
               "95 %": "left", "cannot be told from": "left"}  # fmt: skip
    described = {e["name"]: e for e in result["effects"]}
    rows = []
    for i, hypothesis in enumerate(result["hypotheses"][:8]):
        if hypothesis["probability"] < 1e-3 and i > 1:
            break
        beside = ["something unknown"] if hypothesis["effects"] and hypothesis["unknown"] else []
        name = " + ".join([*hypothesis["effects"], *beside]) or (
            "nothing in the library" if hypothesis["unknown"] else "no gap")
        entry = described.get(name)
        rows.append([name, f"{hypothesis['probability']:.3f}", *(_parameter(entry) if entry else ("", "", "", ""))])
    click.echo()
    print_table("Explanations", headers, rows)
    first = result["hypotheses"][0]["effects"]
    if len(first) > 1:
        click.echo()
        print_table("Effects of the first explanation", {"effect": "left"} | dict(list(headers.items())[2:]),
                    [[name, *_parameter(described[name])] for name in first])
    if found.verdict == "unknown" and result["unknown"] and "places" not in result["unknown"]:  # else the verdict tells
        show_unknown(result["unknown"])
    click.echo()
    channels = result["where"]["channels"]
    print_table("Gap by channel, tolerances of 14 CFR Part 60", {"channel": "left", "before": "right"},
                [[c, f"{v:.2f}"] for c, v in sorted(channels.items(), key=lambda item: -item[1])])
    if "ladder" in result["gap"]:
        show_ladder(result["gap"]["ladder"])
    if result["not_testable"]:
        click.echo()
        click.echo("Not testable: " + "; ".join(f"{n['effect']} ({n['why']})" for n in result["not_testable"]))
    if told := of_the_model(found):
        click.echo(told)
    if given := taken_as_given(found.provenance):
        click.echo("Taken as given: " + "; ".join(note for note, _ in given))
    problems = Counter((problem["channel"], problem["kind"]) for problem in result["data_problems"])
    for (channel, kind), count in problems.items():
        click.echo(f"Record: {channel} {kind}" + (f" ({count} times)" if count > 1 else ""))


def show_unknown(unknown: dict[str, Any]) -> None:
    """The terms that what the library lacks is described by, as the report has them."""
    from sim2real.words import term_named

    click.echo()
    print_table(f"What the library lacks: terms of {unknown['component']} ({unknown['kind']}), SI units",
                {"term": "left", "coefficient": "right", "standard error": "right"},
                [[term_named(t["term"]), f"{t['coefficient']:.4g}", f"{t['std_error']:.2g}"] for t in unknown["terms"]])


def show_ladder(ladder: dict[str, Any]) -> None:
    """What each rung of the evidence ladder leaves of the gap on the held-out records."""
    headers = {"rung": "left", "effects": "left", "gap left": "right", "closed": "right", "95 %": "left"}
    rows = []
    for rung in ladder["rungs"]:
        closed, low, high = (None if rung[k] is None else f"{100.0 * rung[k]:.0f} %"
                             for k in ("closure", "closure_low95", "closure_high95"))  # fmt: skip
        rows.append([rung["name"], ", ".join(rung["effects"]), f"{rung['gap']:.3f}", closed or "-",
                     f"{low} .. {high}" if low else ""])
    click.echo()
    print_table("Evidence ladder: gap on the held-out records, tolerances", headers, rows)
    click.echo(f"Where there is no gap the same search closes {100.0 * ladder['no_gap']['closure']:.1f} %.")


def _parameter(entry: dict[str, Any]) -> tuple[str, str, str, str]:
    from sim2real.words import listed

    name, p = max(entry["parameters"].items(), key=lambda item: item[1]["high95"] - item[1]["low95"])
    return (f"{name} [{p['unit']}]", f"{p['estimate']:.4g}", f"{p['low95']:.4g} .. {p['high95']:.4g}",
            listed(entry["indistinguishable_from"]))
