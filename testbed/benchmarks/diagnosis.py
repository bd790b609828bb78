"""Run the diagnosis over a sealed set of cases, without its keys (`answers`), and score what it says."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from icing_env.errors import InputError
from testbed.benchmarks.answers import OPEN, Progress, answer_all, answered, diagnosis_of
from testbed.benchmarks.failures import HEADERS, failures
from testbed.benchmarks.failures import rows as failed_rows
from testbed.benchmarks.ledger import enter, enter_draw
from testbed.benchmarks.published_sets import publish
from testbed.rivals import RIVALS
from testbed.withheld.draw import DEVELOPMENT_SEED, USUAL
from testbed.withheld.draw import Population as Population
from testbed.withheld.files import read_json, tampered, write_text
from testbed.withheld.generate import generate
from testbed.withheld.manoeuvres import DIAGNOSED
from testbed.withheld.refly import refly
from testbed.withheld.score import BESIDE as ALSO
from testbed.withheld.score import DETECTABLE, identifiable, score
from testbed.workers import a_core_each

QUICK, FULL, STRANGERS, BESIDE = 150, 2400, 40, 24


@a_core_each()
def measure(out: Path, cases: int, seed: int | None, workers: int, progress: Progress,
            without: bool = False, rivals: bool = False, ledger: Path | None = None,
            published: Path | None = None, population: Population = USUAL) -> dict[str, Any]:
    """Draw (or finish drawing) a set in `out`, diagnose every case, fly the answers again, score.

    Args:
        out: folder of records, keys, manifest, answers and answers flown again; what it holds already is kept.
        cases: how many.
        seed: added to the development seed; None lets the operating system choose (a sealed set).
        workers: processes, for flights and diagnoses.
        progress: told what is being done.
        without: diagnose some single effects again, their own effect left out of the library.
        rivals: let every rival (`testbed.rivals`) answer too, into `answers_NAME`; what stands there is scored anyway.
        ledger: file that is told, by a line each, of the set once it is drawn and of its figures.
        published: file that the set is published in once it is scored (`published_sets`).
        population: what is drawn.

    Raises:
        InputError: `out` holds another set, or its files are not those of its manifest.
    """
    committed = drawn(out, cases, seed, workers, progress, population)
    if ledger is not None:
        enter_draw(ledger, kind_of(committed), committed, out)
    names = sorted(committed["cases"])
    answer_all(out, "answers", dict.fromkeys(names, ()), workers, progress, solve)
    for rival in RIVALS if rivals else ():
        answer_all(out, f"answers_{rival}", dict.fromkeys(names, (rival,)), workers, progress, solve_by)
    removed = removals(out / "keys") if without else {}
    if without:  # only now, the ordinary answers being in, does the solver's side learn an effect of any case
        write_text(out / "without.json", json.dumps(removed, indent=1))
        jobs = {name: ((effect,),) for name, effect in removed.items()}
        answer_all(out, "answers_without", jobs, workers, progress, solve)
    refly(out / "answers", out / "keys", out / "refly", workers, progress)
    progress("scoring")
    there = [out / f"answers_{rival}" for rival in RIVALS if any((out / f"answers_{rival}").glob("*.json"))]
    found = score(out / "answers", out / "keys", out / "refly", out / "answers_without", *there)
    found |= {"set": kind_of(committed), "sources": committed["sources"],
              "failures": failures(out / "answers", out / "keys", out / "answers_without")}  # fmt: skip
    if ledger is not None:
        enter(ledger, found, out)
    if published is not None:
        publish(out, published)
    return found


def drawn(out: Path, cases: int, seed: int | None, workers: int, progress: Progress,
          population: Population = USUAL) -> dict[str, Any]:
    """Draw a set in `out`, or finish it; its manifest, and `sources`, the hash of what will answer it.

    Raises:
        InputError: `out` holds another set, or its files are not those of its manifest.
    """
    from icing_env.jit import source_hash

    if (out / "keys").is_dir():
        (out / "keys").chmod(OPEN)  # a run that was killed left it closed
    if (out / "manifest.json").is_file():
        committed = read_json(out / "manifest.json")
        wanted = None if seed is None else DEVELOPMENT_SEED + seed
        there = (committed["count"], committed["development_seed"], Population.of(committed))
        if there != (cases, wanted, population):
            raise InputError(f"{out}: holds a {kind_of(committed)} set of {committed['count']} cases, "
                             "not the one asked for; give another --out")
    else:
        try:
            committed = generate(out, cases, None if seed is None else DEVELOPMENT_SEED + seed, workers, progress,
                                 population)
        except ValueError as error:
            raise InputError(f"{error}; give another --out") from error
    untouched(out, committed)
    return committed | {"sources": source_hash("sim2real")}


def untouched(out: Path, committed: Mapping[str, Any], published: Path | None = None) -> None:
    """Raises an InputError unless the records and keys in `out` are those of its manifest.

    Args:
        published: the file that `out` was unpacked from, which has no records and is named in its place.
    """
    wrong = tampered(None if published else out / "records", out / "keys", committed)
    if wrong:
        raise InputError(f"{published or out}: {'' if published else 'records or '}keys of {len(wrong)} cases are not "
                         f"those of the manifest, the first is {wrong[0]}")


def kind_of(committed: Mapping[str, Any]) -> str:
    """What kind of set a manifest is of: its seed the operating system's, or one that is known; and what it draws."""
    seed = "sealed" if committed["development_seed"] is None else "development"
    spread = f" spread {committed['spread']:g}" if "spread" in committed else ""
    gusts = f" gusts {committed['gusts']}" if "gusts" in committed else ""
    return seed + spread + gusts + "".join(f" {of}" for of in ("strangers", "beside") if of in committed)


def cases_of(population: Population, quick: bool) -> int:
    """How many cases are drawn if it is not said."""
    return STRANGERS if population.strangers else BESIDE if population.beside else QUICK if quick else FULL


def removals(keys: Path) -> dict[str, str]:
    """Single effects to leave out of the library, by case: every effect once at every gust level, where it was drawn.

    Of several cases the identifiable come first, then the detectable; the others are left alone.
    """
    found: dict[tuple[str, float], tuple[bool, str]] = {}
    for path in sorted(keys.glob("*.json")):
        key = read_json(path)
        if key.get("tier") != "single" or key["D_none"] < DETECTABLE:
            continue
        kind, clear = (key["effects"][0], key["sigma_w"]), identifiable(key)
        if kind not in found or (clear and not found[kind][0]):
            found[kind] = (clear, path.stem)
    return {name: effect for (effect, _), (_, name) in sorted(found.items())}


def solve(case: Path, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """The diagnosis of one case's records, as `icing diagnose --json` prints it, some effects left out of the library.

    A record that is refused, or that the solver fails on, is an answer too: {"error": why}, wrong in every figure and
    counted as failed.
    """
    from icing_env.record import read

    def work() -> dict[str, Any]:
        records = [read(path) for path in sorted(case.glob("*.csv"))]
        return diagnosis_of(records[:DIAGNOSED], records[DIAGNOSED:], without=without)

    return answered(work, case)


def solve_by(case: Path, rival: str) -> dict[str, Any]:
    """A rival's answer to one case's records, in the same form; {"error": why} where there is none."""
    from icing_env.record import read
    from testbed.rivals.solve import diagnose

    return answered(lambda: diagnose(rival, [read(path) for path in sorted(case.glob("*.csv"))[:DIAGNOSED]]), case)


def tables(found: dict[str, Any]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """For people: the headline figures of all cases, of mismatched forms, and of answers dealt to the wrong cases."""
    headers = {"figure": "left", "all": "right", "95 %": "left", "other form": "right", "permuted": "right"}
    names = ("cases", "failed", "identifiable_singles", "top1", "top3", "elsewhere_top1", "elsewhere_ideal",
             "null_false_alarm", "pair_exact_set", "identifiable_pairs", "identifiable_pair_exact_set",
             "unknown_auroc_5_to_8", "unknown_auroc_above_8", "unknown_tpr_at_5_fpr", "unknown_placed", "where_f1",
             "ece", "ece_by_luck", "coverage95", "mean_set_size", "parameter_coverage95", "closure_median",
             "closure_p10", "oracle_fraction", "closure_effects_median", "closure_effects_p10",
             "oracle_fraction_effects", "closure_own_median", "closure_own_p10", "oracle_fraction_own",
             "closure_told_median", "seconds_per_case")  # fmt: skip

    def text(value: Any) -> str:
        return "-" if value is None else f"{value}" if isinstance(value, int) else f"{value:.3f}"

    rows = []
    for name in names:
        between = found["intervals95"].get(name)
        rows.append([name.replace("_", " "), text(found[name]),
                     f"{text(between[0])} .. {text(between[1])}" if between else "",
                     text(found["mismatched_form"][name]), text(found["baselines"]["permuted_keys"][name])])
    for gust, value in found["top1_by_gust"].items():
        rows.append([f"top1, sigma_w {gust} m/s", text(value), "",
                     text(found["mismatched_form"]["top1_by_gust"][gust]), ""])
    rows += [[f"{tier}: right", text(entry["right"]), f"of {entry['cases']}", "", ""]
             for tier, entry in found["by_tier"].items()]
    rows += [[f"beside: {name.replace('_', ' ')}", text(entry[name]), "", "", ""]
             for tier, entry in found["by_tier"].items() if tier == "beside" for name in ALSO]  # fmt: skip
    compared = {"solver": found, **found["baselines"]}
    shown = ("top1", "top3", "null_false_alarm", "where_f1", "ece", "log_score", "seconds_per_case")
    beside = [[name.replace("_", " "), *(text(figures[column]) for column in shown)]
              for name, figures in compared.items()]  # fmt: skip
    return [(f"diagnosis, {found['set']} set", headers, rows),
            ("beside others", {"": "left", **{c.replace("_", " "): "right" for c in shown}}, beside),
            ("what failed", HEADERS, failed_rows(found["failures"]))]
