"""What a diagnosis assumed of its records is told where people read: once, and by how many records."""

import pytest

from testbed.cli import main
from testbed.reports.diagnosis import own_numbers
from testbed.reports.given import taken_as_given


def of(*notes: str) -> dict:
    return {"notes": list(notes)}


def test_notes_that_differ_in_their_numbers_alone_are_one_and_counted():
    found = taken_as_given({"records": [of("airspeed late by 80 ms", "flap not recorded: taken as zero"),
                                        of("airspeed late by 79.5 ms")],
                            "held_out": [of("airspeed late by 81 ms", "vanes meet gusts 5.1 m before the wings")]})
    assert found == [("airspeed late by 80 ms", 3), ("flap not recorded: taken as zero", 1),
                     ("vanes meet gusts 5.1 m before the wings", 1)]


def test_a_record_counts_once_however_often_it_says_so():
    assert taken_as_given({"records": [of("a lag of 1 s", "a lag of 2 s")], "held_out": []}) == [("a lag of 1 s", 1)]


def test_people_read_what_was_assumed_in_the_output_and_in_the_report(tmp_path, capsys):
    flown = tmp_path / "flown.csv"
    with pytest.raises(SystemExit):
        main(["fly", "clear_air", "--seed", "1", "--out", str(flown)])
    side = flown.with_suffix(".toml")
    side.write_text(side.read_text().replace('source = "measured"', 'source = "computed"'))
    capsys.readouterr()
    with pytest.raises(SystemExit) as end:
        main(["diagnose", str(flown), "--out", str(tmp_path / "out")])
    told = capsys.readouterr().out
    assert end.value.code == 0
    assert "Taken as given: " in told and "taken as computed: 1.00 of what the published chart makes" in told
    page = (tmp_path / "out" / "report.html").read_text()
    assert "What was taken as given" in page and "taken as computed" in page


def test_offsets_are_told_in_their_unit_and_what_records_say_most_of_first():
    told = own_numbers({"Cm_q": {"change": -0.1, "std_error": 0.05}, "bias_ax": {"change": 0.0021, "std_error": 0.0007},
                        "CZ_alpha": {"change": 0.044, "std_error": 0.01}})  # fmt: skip
    assert told == [["CZ_alpha", "+4.4 %", "1.0 %"], ["bias_ax", "+0.0021 m/s2", "0.0007 m/s2"],
                    ["Cm_q", "-10.0 %", "5.0 %"]]
