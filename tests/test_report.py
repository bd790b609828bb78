"""Reports and figures: one file that needs nothing else, numbered, escaped, written whole or not at all."""

from __future__ import annotations

import base64
import io
import math
import re
import shutil
import subprocess
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from icing_env.errors import InputError
from sim2real.actuators.second_order import DAMPING
from sim2real.where import REGIME_VARIABLES
from testbed.reports.diagnosis import caption_of_terms, regime_row
from testbed.reports.page import Report, figure_source, format_cell
from testbed.reports.plot_style import KNOT, ROLES, SCALES, scale_of
from testbed.reports.plotting import derivative_dots, estimate_history, gap_bars, time_histories

T = np.linspace(0.0, 10.0, 101)


def flight(speed: float = 70.0) -> dict[str, np.ndarray]:
    slow = np.where(np.arange(T.size) % 50 == 0, 3.0e-4, math.nan)
    return {"time": T, "airspeed": speed + T, "alpha": 0.05 + 0.01 * T, "alpha_limit": 0.2 - 0.005 * T, "lwc": slow}


def simple_figure(points: int = 3) -> Figure:
    figure = Figure(figsize=(4, 3))
    figure.subplots().plot(np.random.default_rng(1).normal(size=points))
    return figure


def example() -> Report:
    report = Report("Ice <b>& snow</b>", 'A "sub" title', {"command": "icing demo <x>"})
    report.section("First & last", "One paragraph.\n\nAnother <script>alert(1)</script> one.")
    report.figure(simple_figure(), "A <caption>", alt='what "it" shows')
    report.verdict("It <held>.", "good").verdict("Only said.", "info")
    report.section("Second")
    report.table(["name", "value"], [["<i>a</i>", 1.23456789], ["b", None]], "Numbers")
    report.image(np.zeros((6, 8, 3), np.uint8), "A picture")
    return report.verdict("It broke.", "bad")


class Page(HTMLParser):
    """Tags, their attributes, and the text of a page; a void or unbalanced tag is noticed."""

    VOID = ("meta", "img", "link", "br")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def test_tags_are_balanced() -> None:
    assert Page(example().html()).open == []


def test_nothing_is_loaded_from_anywhere() -> None:
    page = Page(example().html())
    assert not {"script", "link", "iframe", "object", "embed"} & {tag for tag, _ in page.tags}
    for _, attributes in page.tags:
        assert re.match(r"data:image/(png|svg\+xml);base64,", attributes.get("src") or "data:image/png;base64,")
        assert (attributes.get("href") or "#").startswith("#")
        assert not any(name.startswith("on") for name in attributes)
    style = "".join(page.words)
    assert "url(" not in style
    assert "@import" not in style
    assert "://" not in example().html()


def test_pictures_inside_pictures_load_nothing() -> None:
    for source in re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", example().html()):
        svg = base64.b64decode(source).decode()
        assert all(link.startswith(("#", "data:")) for link in re.findall(r'href="([^"]*)"', svg))
        assert all(link.startswith("#") for link in re.findall(r"url\(([^)]*)\)", svg))


def test_text_is_escaped_everywhere() -> None:
    html = example().html()
    for raw in ("<b>&", "<script", "<caption>", "<held>", "<i>", "<x>"):
        assert raw not in html
    words = "".join(Page(html).words)
    for text in ("Ice <b>& snow</b>", "alert(1)", "A <caption>", "It <held>.", "<i>a</i>", "icing demo <x>"):
        assert text in words


def test_links_of_the_contents_lead_somewhere() -> None:
    tags = Page(example().html()).tags
    ids = [attributes["id"] for _, attributes in tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {attributes["href"] for tag, attributes in tags if tag == "a"} <= {f"#{name}" for name in ids}


def test_figures_and_tables_are_numbered_and_described() -> None:
    html = example().html()
    assert re.findall(r"<b>(Figure \d|Table \d)\.</b>", html) == ["Figure 1", "Table 1", "Figure 2"]
    pictures = [attributes for tag, attributes in Page(html).tags if tag == "img"]
    assert [picture["alt"] for picture in pictures] == ['what "it" shows', "A picture"]


def test_verdicts_are_gathered_at_the_head() -> None:
    html = example().html()
    head = html[html.index('class="summary"') : html.index('<section id="s1')]
    assert "It &lt;held&gt;." in head
    assert "It broke." in head
    assert "Only said." not in head


def test_same_report_same_bytes() -> None:
    assert example().html() == example().html()


def test_smaller_of_svg_and_png_is_taken() -> None:
    assert figure_source(simple_figure(3))[0].startswith("data:image/svg")
    figure = Figure(figsize=(4, 3))
    figure.subplots().scatter(*np.random.default_rng(1).normal(size=(2, 5000)))
    assert figure_source(figure)[0].startswith("data:image/png")


def test_image_comes_back_as_it_went_in() -> None:
    array = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    source = re.search(r"data:image/png;base64,([^\"]+)", Report("r").image(array, "c").html())
    assert source is not None

    assert np.array_equal(np.asarray(Image.open(io.BytesIO(base64.b64decode(source[1])))), array)


def test_cells() -> None:
    assert [format_cell(c) for c in (1.23456, -0.5, None, math.nan, -3, "a-b")] == [
        "1.235",
        "−0.5",
        "–",
        "–",
        "−3",
        "a-b",
    ]


def test_write_makes_folders_and_leaves_one_file(tmp_path: Path) -> None:
    path = example().write(tmp_path / "new" / "report.html")
    assert path.read_text(encoding="utf-8") == example().html()
    assert list(path.parent.iterdir()) == [path]


def test_failed_write_keeps_the_old_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "report.html"
    path.write_text("old")

    def fail(self: Path, target: Path) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        example().write(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: Report("r").verdict("x", "goood"), "did you mean 'good'"),
        (lambda: Report("r").table(["a", "b"], [[1, 2], [1]], "t"), "row 1: 1 cells, must be 2"),
        (lambda: Report("r").image(np.zeros((2, 2)), "c"), "must be uint8"),
        (lambda: time_histories({"f": flight()}, ["airsped"]), "did you mean 'airspeed'"),
        (lambda: time_histories({"f": flight()}, ["alpha"], roles={"f": "icd"}), "did you mean 'iced'"),
        (lambda: derivative_dots({}, {"Cm_q": 0.0}), "Cm_q"),
    ],
)
def test_bad_input_is_one_clear_line(call: Callable[[], object], says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)) as raised:
        call()
    assert "\n" not in str(raised.value)


def test_time_histories_show_pilots_units_and_leave_gaps_out() -> None:
    figure = time_histories({"clean": flight(), "iced": flight(60.0)}, ["airspeed", "lwc"])
    speed, water = figure.axes[0], figure.axes[1]
    assert speed.get_ylabel() == "airspeed\n(kt)"
    assert np.allclose(speed.lines[0].get_ydata(), (70.0 + T) / KNOT)
    assert speed.lines[1].get_color() == ROLES["iced"]["color"]
    assert np.allclose(water.lines[0].get_ydata(), 0.3)  # g/m3
    assert np.array_equal(water.lines[0].get_xdata(), T[::50])


def test_limit_is_drawn_where_it_is_known() -> None:
    figure = time_histories({"protected": flight()}, ["alpha"], limits={"alpha": "alpha_limit"})
    assert np.allclose(figure.axes[0].lines[1].get_ydata(), np.degrees(0.2 - 0.005 * T))


def test_estimate_history_shows_interval_and_truth() -> None:
    values, std = {"Cm_alpha": -1.0 - 0.01 * T}, {"Cm_alpha": np.full(T.size, 0.1)}
    axes = estimate_history(T, values, std, {"Cm_alpha": -1.05}, {"Cm_alpha": -1.1}).axes[0]
    band = axes.collections[0].get_paths()[0].vertices
    assert band[:, 1].max() == pytest.approx(-1.0 + 0.196)
    assert [line.get_label() for line in axes.lines] == ["estimate", "truth", "clean aircraft"]
    assert np.allclose(axes.lines[1].get_ydata(), -1.05)


def test_gap_bars_put_the_largest_on_top() -> None:
    axes = gap_bars({"az": 3.0, "q": 0.5, "alpha": 1.5}, {"az": 1.0}).axes[0]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["q", SCALES["alpha"].label, "az"]
    assert [bar.get_width() for bar in axes.containers[0]] == [0.5, 1.5, 3.0]


def test_derivative_dots_are_shares_of_the_reference() -> None:
    axes = derivative_dots({"estimate": {"Cm_q": (-30.0, 1.0)}}, {"Cm_q": -40.0}).axes[0]
    assert np.allclose(axes.containers[0].lines[0].get_xdata(), 0.75)


def test_every_figure_draws_in_a_report() -> None:
    report = Report("All")
    report.figure(time_histories({"a": flight(), "b": flight()}, ["airspeed", "alpha", "lwc"], columns=2), "histories")
    report.figure(estimate_history(T, {"a": T, "b": T * math.nan}, {}, columns=2), "estimates, one of them nan")
    report.figure(gap_bars({"az": 1.0}, noise={"az": 0.4}), "gap")
    assert report.html().count("<img") == 3


def test_browser_shows_the_report(tmp_path: Path) -> None:
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium found: the report was not opened in a browser")
    page = Report("Shown").section("Colours").image(np.full((300, 300, 3), (200, 30, 60), np.uint8), "a red square")
    page.figure(simple_figure(), "a line")
    path, shot = page.write(tmp_path / "report.html"), tmp_path / "shot.png"
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
               "--disable-component-update", "--disable-sync", "--no-first-run", f"--user-data-dir={tmp_path / 'user'}",
               f"--screenshot={shot}", "--window-size=1000,1400", path.as_uri()]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    pixels = np.asarray(Image.open(shot).convert("RGB")).astype(int)
    red = np.abs(pixels - (200, 30, 60)).max(axis=2) < 8
    assert red.sum() == pytest.approx(300 * 300, rel=0.05)
    line = np.abs(pixels - (31, 119, 180)).max(axis=2) < 40  # the default line of the figure below it
    assert line.sum() > 100


def test_a_table_of_terms_says_whether_the_reports_aircraft_has_them():
    terms = {"component": "elevator_path", "kind": "static", "terms": []}
    assert "terms of elevator_path (static), told and not flown;" in caption_of_terms(terms, "What is there", False)
    assert "not flown" not in caption_of_terms(terms, "What is there", True)
    servo = terms | {"terms": [{"term": DAMPING, "coefficient": 0.7, "std_error": 0.01}]}
    assert "told and not flown;" in caption_of_terms(servo, "What is there", True)
    assert "not flown" not in caption_of_terms(terms | {"places": {}}, "What is there", False)


def test_regimes_are_told_in_the_units_of_charts_and_nothing_as_nothing():
    row = regime_row({"variable": "alpha", "low": 0.1, "high": 0.2, "excess": 0.3, "channels": {"q": 0.4}})
    assert row == ["α", pytest.approx(5.729578), pytest.approx(11.459156), "deg", 0.3, "q"]
    still = regime_row({"variable": "rudder", "low": -3.6e-19, "high": 3.6e-19, "excess": 0.3, "channels": {}})
    assert [format_cell(cell) for cell in still[1:4]] == ["0", "0", "deg"] and still[5] == "-"
    units = {name: scale_of(name).unit for name in REGIME_VARIABLES}
    assert all(units.values()), units
