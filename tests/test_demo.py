"""The demonstration: it runs, its report is whole, and its verdicts say what its figures say."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from icing_env import effects
from testbed.demo import demonstration, encounter, gap, identify
from testbed.demo.fleet import ALL, LIMITS, NONE, Fleet
from testbed.flight import fly

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
         "--disable-sync", "--no-first-run", "--virtual-time-budget=5000", "--dump-dom")  # fmt: skip


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> demonstration.Demonstration:
    told: list[float] = []
    folder = tmp_path_factory.mktemp("demo")
    found = demonstration.run(folder, 0, demonstration.QUICK, lambda what, share: told.append(share))
    assert told == sorted(told) and told[-1] == 1.0
    return found


def test_the_report_is_whole_and_needs_nothing_from_outside(shown: demonstration.Demonstration) -> None:
    page = shown.report.read_text(encoding="utf-8")
    assert page.rstrip().endswith("</html>")
    assert not re.findall(r"(?:src|href)=\"(?!data:|#)[^\"]*\"", page) and "<script" not in page
    for part in shown.verdicts.values():
        for verdict in part:
            assert verdict.text.replace("'", "&#39;") in page
    assert page.count("<h2>") >= 6 and page.count("data:image") >= 8


def test_the_scenario_beside_the_report_flies_the_same_hold(shown: demonstration.Demonstration) -> None:
    from icing_env.scenario import load

    written = load(shown.report.parent / "holding_in_ice.toml", duration=20.0)
    ours = fly(encounter.scenario(20.0), seed=3, rate=5.0)
    assert np.array_equal(fly(written, seed=3, rate=5.0).truth["true_alpha"], ours.truth["true_alpha"])


def test_verdicts_of_the_encounter_follow_the_flights(shown: demonstration.Demonstration) -> None:
    e = shown.results["encounter"]
    fleet, lost = e.fleets[ALL], np.array([900.0, np.nan, 300.0, np.nan])
    worse: Fleet = replace(fleet, lost_at=lost)
    safe: Fleet = replace(fleet, lost_at=np.full(4, np.nan))
    helped = encounter.verdicts(replace(e, fleets={NONE: worse, LIMITS: safe, ALL: safe}))[1]
    harmed = encounter.verdicts(replace(e, fleets={NONE: safe, LIMITS: safe, ALL: worse}))[1]
    assert helped.kind == "good" and "2 were lost without protection" in helped.text
    assert harmed.kind == "bad" and "none were lost without" in harmed.text and "2 with boots and limits" in harmed.text
    crashed = replace(e.protected, reason="upset")
    assert encounter.verdicts(replace(e, protected=crashed))[0].kind == "bad"
    drag = crashed.estimate.copy()
    drag["excess_drag"] *= 2.0
    assert encounter.verdicts(replace(e, protected=replace(crashed, estimate=drag)))[2].kind == "caution"


def test_the_batch_flies_what_the_single_flight_flies(shown: demonstration.Demonstration) -> None:
    e = shown.results["encounter"]
    for name, flight in ((NONE, e.unprotected), (ALL, e.protected)):
        least = encounter.margin_of(flight).min()  # the batch looks twice as often
        assert 0.0 <= least - e.fleets[name].margin[0] < np.radians(0.5)


def test_verdicts_of_the_observer_follow_the_errors(shown: demonstration.Demonstration) -> None:
    from testbed.demo.observer import verdicts

    o = shown.results["observer"]
    exact = replace(o, estimate={name: values.copy() for name, values in o.truth.items()})
    assert [v.kind for v in verdicts(exact)] == ["good", "good"]
    far = replace(o, estimate={name: 1.5*values for name, values in o.truth.items()})
    assert [v.kind for v in verdicts(far)] == ["caution", "caution"] and "50.0 % (rms)" in verdicts(far)[0].text


def test_verdicts_of_the_diagnosis_follow_what_was_hidden(shown: demonstration.Demonstration) -> None:
    b = shown.results["diagnosis"]
    assert (b.effect, b.values) == gap.draw(0)
    named = b.found.hypotheses[0]["effects"]
    alike = {b.effect, *named, *(o for e in b.found.effects if [e["name"]] == named
             for o in e["indistinguishable_from"])}  # fmt: skip
    for name, effect in effects.LIBRARY.items():
        other = replace(b, effect=name, values={p.name: p.high for p in effect.parameters})
        if name not in alike:
            assert other.outcome in ("wrong", "untestable") and gap.verdicts(other)[0].kind != "good"
        elif [name] == named and b.found.verdict == "explained":
            assert other.outcome == "right" and "outside" in gap.verdicts(other)[1].text


def test_the_blind_records_do_not_name_the_effect(shown: demonstration.Demonstration) -> None:
    for name in ("blind.csv", "blind.toml", "blind_held_out.csv", "blind_held_out.toml"):
        assert shown.results["diagnosis"].effect not in (shown.report.parent / name).read_text()


def test_without_records_a_simulated_one_is_identified_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ICING_FLIGHT_DATA", str(tmp_path))
    found = identify.measure(0, lambda what, share: None)
    said = identify.verdicts(found)
    assert "were not found" in said[0].text and said[0].kind == "caution"
    assert said[1].kind == "good", said[1].text
    for name in ("CL_alpha", "Cm_alpha"):
        assert found[0].matched[name].estimate == pytest.approx(float(found[0].reference[name]), rel=0.15)


def test_with_records_the_textbook_is_met() -> None:
    if not all((identify.folder() / name).is_file() for name in identify.BOOK):
        pytest.skip(f"no flight records in {identify.folder()}: set ICING_FLIGHT_DATA to their folder")
    found = identify.measure(0, lambda what, share: None)
    assert [v.kind for v in identify.verdicts(found)[:2]] == ["good", "good"]
    wrong = replace(found[0], reference={**found[0].reference, "Cm_q": "-36.45"})
    assert identify.verdicts([wrong, found[1]])[0].kind == "caution"


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: the report is not opened in a browser")
def test_a_browser_shows_the_report(shown: demonstration.Demonstration, tmp_path: Path) -> None:
    environment = {**os.environ, "HOME": str(tmp_path)}
    done = subprocess.run([str(CHROMIUM), *FLAGS, f"--user-data-dir={tmp_path}", shown.report.as_uri()],
                          capture_output=True, text=True, timeout=60, env=environment, check=True)  # fmt: skip
    pictures = re.findall(r"<img [^>]*>", done.stdout)
    assert len(pictures) >= 8 and all('src="data:image' in picture for picture in pictures)
    assert "What to do next" in done.stdout and done.stdout.count('class="verdict') >= 8


def test_the_twenty_lines_run() -> None:
    pytest.importorskip("gymnasium")
    code = demonstration.EXAMPLE.replace("range(3000)", "range(60)")
    assert len([line for line in code.splitlines() if line.strip()]) <= 20
    exec(compile(code, "example", "exec"), {})
