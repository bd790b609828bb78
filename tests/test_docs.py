"""What the documents say is so: the example runs, links lead somewhere, the picture of the tree shows what is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from icing_env.tasks import REWARD_TERMS

ROOT = Path(__file__).resolve().parent.parent
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]


def blocks(page: str, language: str = "") -> list[str]:
    """Fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def test_the_example_runs(capsys):
    example = blocks("README.md", "python")[0]
    assert len(example.splitlines()) <= 21
    exec(compile(example, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.startswith("ended by time")
    assert all(term in printed for term in REWARD_TERMS)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def anchors(page: Path) -> set[str]:
    """Names of a page's headings as GitHub links to them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_to_headings_lead_to_one(page):
    for target, heading in re.findall(r"\]\(([^)#]*)#([^)]+)\)", page.read_text()):
        if "://" not in target:
            assert heading in anchors((page.parent / target).resolve() if target else page), f"{target}#{heading}"


def test_the_picture_of_the_tree_shows_what_is_there():
    package = ""
    for line in blocks("docs/architecture.md")[0].splitlines():
        if not line.startswith(" "):
            package = line.split("/")[0]
            assert (ROOT / package).is_dir(), package
            continue
        for name in line.strip().split("  ")[0].split():
            folder = ROOT / package
            assert (folder / name).is_dir() or list(folder.glob(f"{name}.py")), f"{package}/{name}"
