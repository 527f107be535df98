"""The questions of users in `docs/how-to/README.md`: each has one page, which answers it within one screen."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support import SCENARIO, command

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "how-to"
QUESTIONS = 10
#: Lines of a page that a reader sees without scrolling.
SCREEN = 45


def questions() -> dict[str, str]:
    """Returns the page that answers each question."""
    table = (FOLDER / "README.md").read_text().split("## Questions")[1].split("## ")[0]
    rows = re.findall(r"^\| (.+\?.*) \| \[.+\]\((.+\.md)\) \|$", table, re.MULTILINE)
    return dict(rows)


def blocks(page: str, language: str) -> list[str]:
    """Returns the fenced blocks of a page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", (FOLDER / page).read_text(), re.MULTILINE | re.DOTALL)


def test_each_question_has_one_page_with_a_command_on_its_first_screen() -> None:
    pages = questions()
    assert len(pages) == QUESTIONS and len(set(pages.values())) == QUESTIONS
    for page in pages.values():
        screen = (FOLDER / page).read_text().splitlines()[:SCREEN]
        assert any(re.match(r"\s*closecall [a-z-]", line) for line in screen), page
        assert re.search(r"\]\([^)]+\.md[^)]*\)", (FOLDER / page).read_text()), page


def test_the_query_for_who_hit_whom_has_the_answer_that_the_page_shows(tmp_path: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    page = "who-hit-whom.md"
    done = command("campaign", SCENARIO, "-n", "60", "--seed", "1", "--paired", "--no-gate", "--out", tmp_path / "hits")
    assert done.returncode == 0, done.stderr
    (query,) = blocks(page, "sql")
    answer = duckdb.sql(query.replace("'hits/", f"'{tmp_path}/hits/"))
    shown = [f"| {' | '.join(map(str, row))} |" for row in [answer.columns, *answer.fetchall()]]
    text = (FOLDER / page).read_text()
    assert all(row in text for row in shown), shown


def test_the_jobs_for_gitlab_are_valid_by_its_schema(tmp_path: Path) -> None:
    template = (FOLDER / "ci" / "gitlab.yml").read_text()
    without_a_build, nightly = blocks("gitlab.md", "yaml")
    wrong = nightly.replace("script:", "scripts:")
    files = {"template.yml": template, "image.yml": without_a_build, "nightly.yml": f"{template}\n{nightly}", "wrong.yml": wrong}
    program = Path(sys.executable).with_name("check-jsonschema")
    for name, text in files.items():
        (tmp_path / name).write_text(text)
        words = [program, "--builtin-schema", "vendor.gitlab-ci", "--data-transform", "gitlab-ci", tmp_path / name]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        assert (done.returncode == 0) == (name != "wrong.yml"), f"{name}: {done.stdout}{done.stderr}"
