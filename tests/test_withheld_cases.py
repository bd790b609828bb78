"""Sealed cases: nulls are null, effects act, names carry nothing, hashes tell, an interruption costs nothing."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from icing_env import record
from testbed.benchmarks.diagnosis import kind_of
from testbed.withheld import draw, effects, files, flights, generate, separation, strangers, unknown
from testbed.withheld.conditions import Conditions
from testbed.withheld.manoeuvres import PLANS
from testbed.withheld.published import airframe
from testbed.withheld.shadow import shadow
from testbed.withheld.trim import trimmed

NULL = draw.Design("null", (), 0, 1.0, 0.5, 1.3, 1.0, {}, 7)


@pytest.fixture(scope="module")
def shape() -> separation.Geometry:
    return separation.geometry(0, 1.0, Conditions(0.5, 1.3, 1.0))


@pytest.fixture
def only_nulls(monkeypatch):
    monkeypatch.setattr(draw, "SHARES", {"null": 1.0})


def test_tiers_gusts_forms_and_effects_are_all_drawn():
    drawn = draw.designs(2400, 1)
    tiers = {t: [d for d in drawn if d.tier == t] for t in draw.SHARES}
    assert len(tiers["null"]) >= 900 and len(tiers["single"]) >= 900
    for chosen in tiers.values():
        counts = [sum(d.sigma == s for d in chosen) for s in draw.SIGMAS]
        assert max(counts) - min(counts) <= 1
    assert {d.parts[0][0] for d in tiers["single"]} == {e.name for e in effects.EFFECTS}
    assert {d.parts[0][0] for d in tiers["unknown"]} == {e.name for e in unknown.UNKNOWN}
    assert len(unknown.UNKNOWN) >= 12
    other = np.mean([d.parts[0][1] == "other" for d in tiers["single"]])
    assert 0.45 < other < 0.55
    spread = np.array([d.baseline["Cm_alpha"] for d in drawn])
    assert abs(spread.mean() - 1.0) < 0.005 and 0.045 < spread.std() < 0.055


def test_strangers_are_drawn_alone_each_in_turn_at_every_gust_and_are_in_no_other_list():
    names = {e.name for e in strangers.STRANGERS}
    known = {*effects.BY_NAME, *unknown.BY_NAME, *(e.name for e in strangers.MET)}
    assert len(names) == len(strangers.STRANGERS) and not names & known
    drawn = draw.stranger_designs(3 * len(names), 1)
    assert {d.tier for d in drawn} == {"unknown"}
    assert {(d.parts[0][0], d.sigma) for d in drawn} == {(n, s) for n in names for s in draw.SIGMAS}
    assert not names & {d.parts[0][0] for d in draw.designs(2400, 1) if d.parts}
    assert draw.stranger_designs(20, 5) == draw.stranger_designs(20, 5) != draw.stranger_designs(20, 6)


def test_beside_effects_of_the_library_an_unknown_one_enters_elsewhere():
    drawn = draw.beside_designs(2 * len(effects.EFFECTS), 1)
    assert {d.tier for d in drawn} == {"beside"}
    assert {d.parts[0][:2] for d in drawn} == {(e.name, form) for e in effects.EFFECTS for form in ("same", "other")}
    for (known, _, _), (strange, _, _) in (design.parts for design in drawn):
        assert not {*effects.BY_NAME[known].where} & {*unknown.BY_NAME[strange].where}
    assert len({d.parts[1][0] for d in drawn}) == len(unknown.UNKNOWN)
    assert draw.beside_designs(20, 5) == draw.beside_designs(20, 5) != draw.beside_designs(20, 6)


def test_what_is_known_keeps_its_size_and_what_is_unknown_stands_as_far_as_was_drawn(shape):
    design = replace(NULL, tier="beside", target=12.0,
                     parts=(("elevator_power", "same", -0.3), ("fuel_slosh", "same", 200.0)))  # fmt: skip
    _, key = generate.make_case("a", design, shape)
    assert key["parameters"]["elevator_power"] == {effects.BY_NAME["elevator_power"].parameter: -0.3}
    assert key["D_strange"] == pytest.approx(12.0, rel=0.15)
    assert key["D_known"] == pytest.approx(separation.distances(0, 1.0, shape, design.parts[:1]).none)
    assert key["D_none"] > max(key["D_known"], key["D_strange"]) - 2.0  # both together
    assert key["known"] == ["elevator_power"] and key["where_strange"] == sorted(unknown.BY_NAME["fuel_slosh"].where)


def test_sizes_stay_within_what_the_protocol_allows():
    drawn = [part for d in draw.designs(2400, 1) if d.tier == "single" for part in d.parts]
    ratios = [abs(size / effects.BY_NAME[name].typical) for name, _, size in drawn]
    # beyond 1.5 only where the spread of derivatives or a near rival hides what is smaller
    assert min(ratios) >= 0.2 and max(ratios) <= 3.1
    assert set(draw.LARGER) <= {e.name for e in effects.EFFECTS}


def test_a_seed_draws_the_same_cases_and_another_one_others():
    assert draw.designs(20, 5) == draw.designs(20, 5)
    assert draw.designs(20, 5) != draw.designs(20, 6)


def test_a_case_without_effects_is_the_published_aircraft_and_its_spread():
    texts, key = generate.make_case("a", NULL, None)
    assert flights.Aircraft().row().tobytes() == airframe().tobytes()
    assert flights.Aircraft().instruments() == {}
    assert key["effects"] == [] and key["D_none"] == 0.0 and key["where"] == []
    spread = replace(NULL, baseline={"Cm_alpha": 1.05})
    row = flights.Aircraft(spread.baseline).row()
    assert {n for n in row.dtype.names if row[n] != airframe()[n]} == {"Cm_alpha"}
    assert len(texts) == 2 * len(PLANS[0])


@pytest.mark.parametrize("pool", [effects.EFFECTS, unknown.UNKNOWN, strangers.MET, strangers.STRANGERS],
                         ids=["library", "unknown", "met", "strangers"])
def test_every_effect_does_something_in_each_of_its_forms(pool, shape):
    for effect in pool:
        for form in ("same", "other") if effect.same is not effect.other else ("same",):
            size = min(1.8 * effect.typical, draw.MOST.get(effect.name, np.inf))
            found = separation.distances(0, 1.0, shape, ((effect.name, form, size),))
            assert found.none > 0.5, (effect.name, form)
            if form == "same" and effect.name in found.rivals:
                assert found.rivals[effect.name] < 0.1 * found.none + 0.2, effect.name


def test_distances_of_a_pair_tell_it_from_every_other_set(shape):
    parts = (("elevator_power", "same", -0.3), ("rudder_power", "same", 0.5))
    found = separation.distances(0, 1.0, shape, parts)
    assert found.own_set < 0.1 * found.none + 0.2 and found.pair == pytest.approx(found.own_set)
    assert found.rival_set <= min(found.rivals.values())  # each alone, and every other pair
    alone = [separation.distances(0, 1.0, shape, (part,)).none for part in parts]
    assert found.rival_set < min(alone) + 0.2  # no farther than the smaller one by itself
    single = separation.distances(0, 1.0, shape, parts[:1])
    assert single.own_set is None and single.rival_set is None


def test_the_nearest_pair_is_sought_among_all_of_them():
    """One solve for every set gives what solving each by itself gives."""
    own, to = 50.0, np.linspace(1.0, 3.0, 8)
    among = np.diag(np.arange(4.0, 12.0)) + 0.3
    at = np.array([[0, 1], [1, 3], [0, 2]])
    found = separation._left(own, to, among, at)
    for (i, j), d in zip(at, found, strict=True):
        k = [2 * i, 2 * i + 1, 2 * j, 2 * j + 1]
        assert d == pytest.approx((own - to[k] @ np.linalg.solve(among[np.ix_(k, k)], to[k])) ** 0.5, rel=1e-6)


@pytest.mark.parametrize(("effect", "size", "derivatives"), [
    ("roll_damping", -0.3, 1), ("elevator_power", 0.25, 2), ("side_force", 0.5, 1)])  # fmt: skip
def test_derivatives_stand_no_farther_from_none_than_their_spread_allows(effect, size, derivatives, shape):
    """An aircraft with those derivatives off by as much is a null of just that prior probability."""
    none = separation.distances(0, 1.0, shape, ((effect, "same", size),)).none
    most = derivatives**0.5 * abs(size) / draw.SPREAD
    assert 0.5 * most < none < 1.06 * most


def test_departures_along_the_published_flight_are_in_proportion_and_vanish_with_the_effect():
    """A trim that rolls the aircraft over within the manoeuvre leaves what twice as much of it would, halved."""
    still = flights.fly(flights.Aircraft(), PLANS[0][0])
    y0, u0, _ = shadow(flights.Aircraft(), still, PLANS[0][0].speed)
    assert np.abs(y0).max() < 1e-6 and np.abs(u0).max() < 1e-6
    once, twice = (shadow(flights.Aircraft(parts=(("roll_trim", "same", size),)), still, PLANS[0][0].speed)[0][:, 3]
                   for size in (0.002, 0.004))  # fmt: skip
    assert np.abs(once).max() > 1e-3
    assert twice == pytest.approx(2.0 * once, rel=0.02, abs=1e-5)


def test_forms_called_other_are_other():
    for effect in effects.EFFECTS:
        assert effect.same(effect.typical) != effect.other(effect.typical), effect.name


def test_records_are_read_and_carry_no_label(tmp_path):
    hidden = replace(NULL, tier="unknown", parts=(("fuel_slosh", "same", 200.0),))
    texts, key = generate.make_case("0a1b", hidden, None)
    plain, _ = generate.make_case("0a1b", NULL, None)
    assert {n: t for n, t in texts.items() if n.endswith(".toml")} == {
        n: t for n, t in plain.items() if n.endswith(".toml")}  # fmt: skip
    words = {*flights.CATALOGUE, *draw.SHARES, "same", "other", "sigma", key["salt"]}
    for name, text in texts.items():
        assert not [word for word in words if word in text or word in name]
        assert text.splitlines()[0] == plain[name].splitlines()[0]
    files.write_case(tmp_path / "0a1b", texts)
    read = [record.read(path) for path in sorted((tmp_path / "0a1b").glob("*.csv"))]
    assert [r.meta.role for r in read] == ["diagnose"] * 3 + ["held_out"] * 2
    assert read[0].meta.mass == 4951.0 and len(read[0]) == 2001


def test_records_are_drawn_again_beside_their_keys(tmp_path, only_nulls):
    sealed = generate.generate(tmp_path, 3)
    shutil.rmtree(tmp_path / "records")
    assert generate.generate(tmp_path, 3) == sealed
    assert files.tampered(tmp_path / "records", tmp_path / "keys", sealed) == []
    manifest = tmp_path / "manifest.json"
    manifest.write_text(manifest.read_text().replace(min(sealed["cases"].values(), key=str)["records"], "0" * 64))
    shutil.rmtree(tmp_path / "records")
    with pytest.raises(ValueError, match="not what its manifest tells"):
        generate.generate(tmp_path, 3)


def test_names_of_a_sealed_set_are_random_and_in_no_order(tmp_path, only_nulls):
    of = draw.Population
    strangers, beside, wide, mixed = of(strangers=True), of(beside=True), of(spread=0.08), of(gusts="mixed")
    first, _, known = generate._roll(tmp_path / "a.json", 40, None, draw.USUAL)
    second, *_ = generate._roll(tmp_path / "b.json", 40, None, draw.USUAL)
    assert not known
    assert not set(first) & set(second)
    assert first != sorted(first)
    assert generate._roll(tmp_path / "a.json", 40, None, draw.USUAL)[0] == first
    with pytest.raises(ValueError, match="another seed"):
        generate._roll(tmp_path / "a.json", 41, None, draw.USUAL)
    with pytest.raises(ValueError, match="another seed"):  # a sealed set is not finished as a development set
        generate._roll(tmp_path / "a.json", 40, 3, draw.USUAL)
    for alone in (strangers, beside):
        with pytest.raises(ValueError, match="another seed"):  # nor as one of these alone
            generate._roll(tmp_path / "a.json", 40, None, alone)
    for other in (wide, mixed):
        with pytest.raises(ValueError, match="spread or gusts"):
            generate._roll(tmp_path / "a.json", 40, None, other)
    for file, alone in (("c.json", strangers), ("d.json", beside)):  # no records with faults
        assert len(generate._roll(tmp_path / file, 40, None, alone)[0]) == 40


def test_derivatives_of_another_spread_are_off_by_as_many_deviations():
    case = draw.designs(8, 3)[0]
    wide = draw.wider(case.baseline, 2.0 * draw.SPREAD)
    assert draw.wider(case.baseline, draw.SPREAD) == case.baseline
    assert wide["mass"] == case.baseline["mass"]
    for name in draw.DERIVATIVES:
        assert wide[name] - 1.0 == pytest.approx(2.0 * (case.baseline[name] - 1.0))


def test_aircraft_of_a_calibrated_set_are_as_before_but_for_what_nobody_knows_better():
    usual = draw.USUAL.placed(draw.designs(40, 3), 3)
    today = draw.Population(calibrated=True).placed(draw.designs(40, 3), 3)
    own = {**draw.TOLD_ONCE, **draw.CALIBRATION}
    for before, now in zip(usual, today, strict=True):
        assert set(now.baseline) - set(before.baseline) == set(own)
        assert replace(now, baseline=before.baseline, parts=before.parts) == before
        times = [draw.LARGER_STILL.get(name, 1.0) for name, _, _ in now.parts]
        assert [size for *_, size in now.parts] == [t * s for t, (*_, s) in zip(times, before.parts, strict=True)]
        assert {name: now.baseline[name] for name in before.baseline} == before.baseline
    for name, size in own.items():
        off = [case.baseline[name] - (name in draw.TOLD_ONCE) for case in today]
        assert 0.6 * size < np.std(off) < 1.5 * size and abs(np.mean(off)) < 0.6 * size
    at = flights.Aircraft(today[0].baseline)
    assert at.instruments() == {name: today[0].baseline[name] for name in draw.CALIBRATION}
    assert at.row()["engine_arm_z"] == flights.Aircraft().row()["engine_arm_z"] * today[0].baseline["engine_arm_z"]
    assert draw.Population(calibrated=True).told() == {"calibrated": True}


def test_aircraft_of_a_rigged_set_are_as_before_but_for_rigging():
    kind = {"gusts": "mixed", "calibrated": True}
    before = draw.Population(**kind).placed(draw.designs(40, 3), 3)
    today = draw.Population(**kind, rigged=True).placed(draw.designs(40, 3), 3)
    own = {**draw.RIGGING, **draw.GEARING}
    for was, now in zip(before, today, strict=True):
        assert replace(now, baseline=was.baseline) == was
        assert now.baseline == was.baseline | {name: now.baseline[name] for name in own}
    for name, size in own.items():
        off = [case.baseline[name] - (name in draw.GEARING) for case in today]
        assert 0.6 * size < np.std(off) < 1.5 * size and abs(np.mean(off)) < 0.6 * size
    one = today[0].baseline
    at, clean = flights.Aircraft(one).row(), flights.Aircraft().row()
    for name in own:
        if not name.startswith("bias_"):
            assert at[name] == (clean[name] + one[name] if name in draw.RIGGING else clean[name] * one[name])
    assert {name: flights.Aircraft(one).instruments()[name] for name in ("bias_p", "bias_q", "bias_r")} == {
        name: one[name] for name in ("bias_p", "bias_q", "bias_r")}
    offset = flights.Aircraft(one, (("elevator_offset", "same", 0.01),)).row()["elevator_offset"]
    assert offset == pytest.approx(0.01 + one["elevator_offset"])


def test_an_aircraft_whose_ailerons_rest_in_a_dead_zone_is_trimmed():
    """Rigged a little off it needs aileron, of which the dead zone lets nothing through: no slope led anywhere."""
    off, part = {"Cl_0": 2e-4, "aileron_offset": 1e-3}, ("aileron_dead_zone", "same", 0.02)
    free, dead = (trimmed(flights.Aircraft(off, parts).row(), 65.0)[1] for parts in ((), (part,)))
    assert dead == pytest.approx([free[0], free[1] + np.copysign(0.02, free[1]), *free[2:]], abs=1e-6)


def test_a_set_of_another_spread_says_so(tmp_path, only_nulls):
    sealed = generate.generate(tmp_path, 3, 11, population=draw.Population(spread=0.08))
    assert sealed["spread"] == 0.08 and kind_of(sealed) == "development spread 0.08"
    as_published = generate.generate(tmp_path / "published", 3, 11)
    assert "spread" not in as_published and kind_of(as_published) == "development"


def test_an_interrupted_draw_goes_on_and_tampering_is_told(tmp_path, only_nulls):
    def stop(text: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate.generate(tmp_path, 3, 11, progress=stop)
    made = sorted(p.name for p in (tmp_path / "records").iterdir())
    assert 0 < len(made) < 3 and not (tmp_path / "manifest.json").exists()
    before = {n: (tmp_path / "records" / n / "1.csv").stat().st_mtime_ns for n in made}
    sealed = generate.generate(tmp_path, 3, 11)
    assert {n: (tmp_path / "records" / n / "1.csv").stat().st_mtime_ns for n in made} == before
    assert len(sealed["cases"]) == 3
    check = tmp_path / "records", tmp_path / "keys", sealed
    assert files.tampered(*check) == []
    one, two, three = sorted(sealed["cases"])
    key = tmp_path / "keys" / f"{one}.json"
    key.write_text(json.dumps(json.loads(key.read_text()) | {"tier": "single"}))
    csv = tmp_path / "records" / two / "4.csv"
    csv.write_text(csv.read_text().replace("0.0", "0.1", 1) + "\n")
    (tmp_path / "records" / three / "2.toml").unlink()
    assert files.tampered(*check) == [one, two, three]
