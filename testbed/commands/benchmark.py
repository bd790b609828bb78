"""`icing benchmark`: how fast (`speed`), how well ice (`characterisation`) and gaps (`diagnosis`) are told.

`protection`, `adaptation`: what they are worth; `policies`: what a gap does to a choice between controllers;
`real_flight`: recorded flights diagnosed; `recordings`: the same flights as other recorders would have them;
`elsewhere`: flights of a plant made elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from icing_env.errors import InputError, nearest
from testbed.commands.common import print_json, print_table, verb

NAMES = ("speed", "characterisation", "protection", "adaptation", "diagnosis", "real_flight",
         "policies", "recordings", "elsewhere")
GUSTS = ("later", "turning", "at_once", "rolling", "mixed")
EXAMPLE = """icing benchmark speed --json
icing benchmark characterisation --quick --figure out/reliability.png
icing benchmark protection --encounters 200 --json
icing benchmark diagnosis --quick --out out/withheld
icing benchmark diagnosis --pool out/first --pool out/second.tar.xz
icing benchmark diagnosis --jsbsim"""


@verb("benchmark", EXAMPLE)
@click.argument("name", type=click.Choice(NAMES))
@click.option("--quick", is_flag=True, help="few flights, to see that it works (not speed).")
@click.option("--weights", type=click.Path(path_type=Path), help="characterisation: folder of a training.")
@click.option("--figure", type=click.Path(path_type=Path), help="characterisation: reliability curves as PNG.")
@click.option("--encounters", type=click.IntRange(min=2), help="protection: encounters per row; 1000 if omitted.")
@click.option("--only", metavar="A,B,...",
              help="of these only, named as the tables name them. protection: rows; real_flight, policies: cases; "
                   "recordings: recorders.")
@click.option("--cases", type=click.IntRange(min=8),
              help="how many. diagnosis: 2400 if omitted, 150 with --quick; recordings: 24, 8; elsewhere: 12.")
@click.option("--fresh-seed", is_flag=True, help="diagnosis: a sealed set, its seed from the operating system.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/withheld"),
              show_default=True, help="diagnosis, recordings, elsewhere: what was drawn and answered; a run goes on.")
@click.option("--pool", multiple=True, type=click.Path(path_type=Path),
              help="diagnosis: draw and solve nothing, score these sets together: --out folders or --publish files.")
@click.option("--publish", type=click.Path(path_type=Path, dir_okay=False),
              help="diagnosis: write answers and keys, once scored, to that file (.tar.xz).")
@click.option("--jsbsim", is_flag=True, help="diagnosis: JSBSim's DHC-6 as the aircraft; 16 cases if not told.")
@click.option("--jsbsim-root", type=click.Path(file_okay=False), help="diagnosis: a JSBSim tree; else JSBSIM_ROOT.")
@click.option("--ledger", type=click.Path(path_type=Path, dir_okay=False),
              help="diagnosis: append to that file what was drawn, and then its figures.")
@click.option("--without", is_flag=True, help="diagnosis: also each effect in turn left out of the library.")
@click.option("--rivals", is_flag=True, help="diagnosis: diagnoses of other kinds answer too, as baselines.")
@click.option("--strangers", is_flag=True, help="diagnosis: only effects that nobody had in mind; 40 if not told.")
@click.option("--beside", "company", is_flag=True,
              help="diagnosis: only effects of the library with one of no list beside; 24 if not told.")
@click.option("--spread", type=click.FloatRange(min=0.0, max=0.3), default=0.05, show_default=True,
              help="diagnosis: of the aircraft's derivatives about the published ones, one standard deviation.")
@click.option("--gusts", type=click.Choice(GUSTS), default="later", show_default=True,
              help="diagnosis: how they differ along the aircraft; mixed: each kind in turn.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True,
              help="diagnosis, recordings, elsewhere: processes.")
def command(name: str, quick: bool, weights: Path | None, figure: Path | None, encounters: int | None,
            only: str | None, cases: int | None, fresh_seed: bool, out: Path, ledger: Path | None, workers: int,
            without: bool, rivals: bool, strangers: bool, company: bool, spread: float, gusts: str,
            pool: tuple[Path, ...], publish: Path | None, jsbsim: bool, jsbsim_root: str | None, as_json: bool,
            seed: int) -> None:
    """Measure the testbed.

    `speed`: one aircraft and batches, with and without observer, one thread, beside JSBSim in the same run (if it is
    installed: the extra `peers`). `characterisation`: classes, detection, false alarms, protection, reliability, on
    flights that no fit has seen. `protection`: shares of drawn encounters with ice and turbulence in which the
    autopilot stalls or departs, unprotected, with every protection and with the true ice known; nuisance in clear air;
    the time that a protection takes. `adaptation`: flying qualities of iced aircraft with the control laws adapted,
    against the clean aircraft's. `diagnosis`: gaps drawn and flown by a plant of the benchmark's own, half of them in
    another form than the library's, some in no library; the solver does not see the keys. 2400 cases take some six
    hours on two cores. `recordings`: some of these flights as other recorders would have them, slower, on fewer
    levels, with holes, in part. `elsewhere`: clean aircraft and gaps of a second plant, of which nothing but where they
    enter and how far they close is scored. `real_flight`: NASA's recorded flights (ICING_FLIGHT_DATA) and the founding
    paper's own gap. `policies`: which ranking of controllers a gap turns round, before the diagnosis and after. Seeds
    are fixed in the code, apart from those of the training; --seed changes nothing but the sets of `diagnosis`,
    `recordings` and `elsewhere`.
    """
    if name == "speed":
        _speed(as_json)
        return
    if name == "protection":
        _protection(quick, encounters, only, as_json)
        return
    if name == "adaptation":
        _adaptation(quick, as_json)
        return
    if (pool or jsbsim or jsbsim_root) and (publish or ledger):
        option, beside = "--publish" if publish else "--ledger", "--pool" if pool else "--jsbsim"
        raise InputError(f"{option}: of a set that is drawn and solved; leave it out with {beside}")
    if publish is not None and publish.exists():
        raise InputError(f"{publish}: is there already, and a published set stays as it is; give another --publish")
    if name == "diagnosis" and (jsbsim or jsbsim_root):
        _jsbsim(cases, seed, out / "jsbsim", workers, jsbsim_root, as_json)
        return
    if name == "diagnosis" and pool:
        _pooled(pool, as_json)
        return
    if name == "diagnosis":
        from testbed.benchmarks.diagnosis import Population, cases_of

        if strangers and company:
            raise InputError("--beside: of another set than --strangers; give one of them")
        drawn = Population(strangers, spread, gusts, calibrated=True, rigged=True, beside=company)
        alone = "strangers" if strangers else "beside" if company else ""
        _diagnosis(cases or cases_of(drawn, quick), None if fresh_seed else seed, out / alone, workers, as_json,
                   without=without, rivals=rivals, ledger=ledger, published=publish, population=drawn)  # fmt: skip
        return
    if name in ("real_flight", "policies"):
        _cases(name, only, as_json)
        return
    if name == "recordings":
        _recordings(cases or (8 if quick else None), only, seed, out / "recordings", workers, as_json)
        return
    if name == "elsewhere":
        _elsewhere(cases, seed, out / "elsewhere", workers, as_json)
        return
    from testbed.characterisation.benchmark import draw, measure, tables

    found = measure(quick, weights, lambda what: click.echo(f"{what} ...", err=True))
    if figure is not None:
        draw(found, figure)
    _show(found, tables(found), as_json)


def _cases(name: str, only: str | None, as_json: bool) -> None:
    from importlib import import_module

    study = import_module(f"testbed.benchmarks.{name}")
    found = study.measure(_listed(only), lambda what: click.echo(f"{what} ...", err=True))
    if as_json:
        print_json(found)
        return
    for case, (title, headers, rows) in zip(found, study.tables(found), strict=True):
        print_table(title, headers, rows)
        for sentence in case.sentences:
            click.echo(sentence)
        click.echo()


def _recordings(cases: int | None, only: str | None, seed: int, out: Path, workers: int, as_json: bool) -> None:
    from testbed.benchmarks.recordings import measure, tables

    found = measure(out, cases, seed, workers, _listed(only), lambda what: click.echo(what, err=True))
    _show(found, tables(found), as_json)


def _elsewhere(cases: int | None, seed: int, out: Path, workers: int, as_json: bool) -> None:
    from testbed.benchmarks.elsewhere import measure, tables

    found = measure(out, cases, seed, workers, lambda what: click.echo(what, err=True))
    _show(found, tables(found), as_json)


def _listed(only: str | None) -> list[str]:
    return [name.strip() for name in only.split(",")] if only else []


def _adaptation(quick: bool, as_json: bool) -> None:
    from testbed.benchmarks.adaptation import measure, tables

    found = measure(quick, lambda what: click.echo(f"{what} ...", err=True))
    _show(found, tables(found), as_json)


def _diagnosis(cases: int, seed: int | None, out: Path, workers: int, as_json: bool, **options: Any) -> None:
    from testbed.benchmarks.diagnosis import measure, tables

    found = measure(out, cases, seed, workers, lambda what: click.echo(what, err=True), **options)
    _show(found, tables(found), as_json)


def _pooled(folders: tuple[Path, ...], as_json: bool) -> None:
    from testbed.benchmarks.diagnosis import tables
    from testbed.benchmarks.pooled_sets import pooled

    found = pooled(folders)
    _show(found, tables(found), as_json)


def _show(found: Any, tables: Iterable[tuple[str, dict[str, str], list[list[str]]]], as_json: bool) -> None:
    """What was measured: as JSON, or as tables for people."""
    if as_json:
        print_json(found)
        return
    for title, headers, rows in tables:
        print_table(title, headers, rows)


def _jsbsim(cases: int | None, seed: int, out: Path, workers: int, root: str | None, as_json: bool) -> None:
    from testbed.benchmarks.jsbsim import measure, tables

    found = measure(out, cases, seed, workers, root, lambda what: click.echo(what, err=True))
    _show(found, tables(found), as_json)


def _protection(quick: bool, encounters: int | None, only: str | None, as_json: bool) -> None:
    from testbed.benchmarks.protection import WHO, measure, tables

    names = tuple(_listed(only))
    for name in names:
        if name not in WHO:
            raise InputError(f"no row '{name}' of the protection benchmark: {nearest(name, list(WHO))}")
    found = measure(quick, encounters, lambda what: click.echo(f"{what} ...", err=True), names)
    _show(found, tables(found), as_json)


def _speed(as_json: bool) -> None:
    from testbed.benchmarks.speed import measure

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
