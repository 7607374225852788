"""The page of a study, from results made up here: numbers that can be checked in the head."""

from __future__ import annotations

import csv
import io
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from PIL import Image

from ambulo.study import tables
from ambulo.study.curves import DARK, spread_out
from ambulo.study.page import write_page
from ambulo.study.published import GENERATIONS, JUMP, PUBLISHED, RUN, marks_of
from ambulo.study.totals import kind_of
from ambulo.study.words import duration

VOID = {"meta", "img", "br", "source"}


def made_run(creature: str, task: str, seed: int, final: float, usable: bool) -> dict[str, Any]:
    """A run that climbs in a straight line from `final / 300` to `final`, 0.01 s a generation."""
    best = [final * (g + 1) / GENERATIONS for g in range(GENERATIONS)]
    marks = [
        {
            "generation": generation,
            "seconds": generation * 0.01,
            "fitness": best[generation - 1],
            "usable": usable,
            "reasons": [] if usable else [f"upright in {80 + seed} % of steps", "a leg is idle"],
            "judgement": {"speed_bl_s": 0.5, "legs_used": "3/4", "standing": usable},
        }
        for generation in sorted({generation for _, generation in marks_of(creature, task)})
    ]
    mean = [fitness / 2 for fitness in best]
    return {"seed": seed, "best": best, "mean": mean, "seconds": 3.0, "marks": marks}


def made_case(creature: str, task: str, runs: int = 4) -> dict[str, Any]:
    """Run n ends at 10 n metres; the odd ones are usable."""
    return {
        "creature": creature,
        "name": PUBLISHED.case(creature, task).name,
        "legs": 4,
        "joints": 8,
        "task": task,
        "steps": 2000 if task == RUN else 500,
        "runs": [made_run(creature, task, n, 10.0 * n, n % 2 == 1) for n in range(1, runs + 1)],
        "picture": None,
        "film": None,
        "gait": None,
    }


def made_study(cases: list[dict[str, Any]], runs: int = 4) -> dict[str, Any]:
    return {
        "machine": {"cpu": "A processor", "cores": 2, "system": "Linux", "load": 0.1},
        "started": "2030-05-06T07:08:09+00:00",
        "runs": runs,
        "generations": GENERATIONS,
        "population": 50,
        "seconds": 75.0,
        "version": "0.1.0",
        "settings": {"mutation": {"rate": 0.125}, "hidden": [10]},
        "cases": cases,
    }


class Reader(HTMLParser):
    """Checks that tags are balanced, and keeps what pages refer to."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.anchors: set[str] = set()
        self.text: list[str] = []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "img":
            self.images.append(values)
        self.anchors.add(values.get("id") or "")
        self.links += [v for k in ("src", "href", "srcset") if (v := values.get(k))]

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.text.append(data)

    @property
    def words(self) -> str:
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A complete study's page."""
    folder = tmp_path_factory.mktemp("study")
    Image.new("RGB", (60, 20)).save(folder / "a strip.png")
    cases = [made_case(case.creature, case.task) for case in PUBLISHED.cases]
    cases[0] |= {"picture": "a strip.png", "film": "gone.gif"}
    write_page(folder, made_study(cases))
    return folder


def read(folder: Path) -> Reader:
    return Reader((folder / "index.html").read_text())


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text())))


# What the thesis says -----------------------------------------------------------------------


def test_published_figures_agree_with_each_other() -> None:
    assert len(PUBLISHED.cases) == 14
    for case in PUBLISHED.cases:
        assert case.marks[-1].fitness == max(case.finals)
        assert [m.generation for m in case.marks] == sorted(m.generation for m in case.marks)
    assert [c.figure for c in PUBLISHED.cases] == [
        f"5.{n}" for n in (1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15)
    ]
    assert [c.appendix for c in PUBLISHED.cases] == [f"A.{n}" for n in range(1, 15)]
    assert PUBLISHED.minutes_for_one_run_each() == 192 + 58
    assert sum(case.usable for case in PUBLISHED.cases) == 10
    assert [c.rating_figure for c in PUBLISHED.cases if c.rating] == [
        f"5.{n}" for n in range(17, 27)
    ]


@pytest.mark.parametrize(
    ("creature", "task", "generations"),
    [
        ("apod", RUN, [15, 75, 300]),
        ("tetrapod2", RUN, [11, 55, 300]),
        ("decapod2", RUN, [5, 25, 300]),
        ("biped1", JUMP, [60, 300, 300]),
        ("tetrapod2", JUMP, [37, 187, 300]),
        ("decapod2", JUMP, [13, 68, 300]),
    ],
)
def test_marks(creature: str, task: str, generations: list[int]) -> None:
    assert marks_of(creature, task) == list(
        zip(["1 min", "5 min", "end"], generations, strict=True)
    )


def test_marks_of_an_unknown_case() -> None:
    with pytest.raises(ValueError, match="no case 'centipede' with task 'run'"):
        marks_of("centipede", RUN)


# The page -----------------------------------------------------------------------------------


def test_all_that_the_page_refers_to_is_there(whole: Path) -> None:
    page = read(whole)
    for link in page.links:
        assert ":" not in link, "no address elsewhere"
        if link.startswith("#"):
            assert link[1:] in page.anchors
        else:
            assert (whole / unquote(link)).is_file(), link
    figures = [image for image in page.images if (image["src"] or "").endswith(".svg")]
    assert len(figures) == 14 + 14 + 2
    assert all(image["alt"] for image in page.images)


def test_every_figure_of_the_thesis_has_its_counterpart(whole: Path) -> None:
    words = read(whole).words
    for number in [*(f"5.{n}" for n in range(1, 17)), *(f"A.{n}" for n in range(1, 15))]:
        assert re.search(rf"as its figure {re.escape(number)}(?!\d)", words), number


def test_pictures_that_are_there_and_that_are_not(whole: Path) -> None:
    page = read(whole)
    strip = next(image for image in page.images if image["src"] == "a%20strip.png")
    assert (strip["width"], strip["height"]) == ("60", "20")
    assert "gone.gif is not there" in page.words


def test_summary_is_counted_from_the_data(whole: Path) -> None:
    """Best of the first three is run 3, which is usable; two of four runs are, in every case."""
    words = read(whole).words.replace("\u00a0", " ")
    assert "Of the 14 cases that came to the last generation" in words
    assert "is usable in 14; of the same cases the thesis counts 10." in words
    assert "28 of 56 runs are usable (50 %)" in words
    # 56 runs of 3 s against 4 × 250 min.
    assert "The 56 finished runs took 2 min 48 s of evolution" in words
    assert "took the thesis 16 h 40 min, 357 times as long" in words
    assert "all of its own runs took 41 h 40 min" in words
    assert "a leg is idle (28); upright in … of steps (28)" in words
    assert "Decapod 2 jumping, 2 of 4 runs" in words
    assert "not complete" not in words


def test_table_of_training_time(whole: Path) -> None:
    rows = rows_of(whole / "tables" / "table-5.1.csv")
    assert len(rows) == 7 * 3
    assert rows[12] == {
        "creature": "tetrapod2",
        "when": "1 min",
        "generation": "11",
        "thesis_minutes": "1",
        "thesis_fitness": "19.9",
        "thesis_share_of_end": "0.14533",
        "thesis_usable": "no",
        "seconds": "0.11",
        "fitness": "1.1",
        "share_of_end": "0.0366667",
        "usable": "yes",
        "why_not": "",
        "run": "3",
        "usable_runs": "2",
        "judged_runs": "4",
    }
    decapod = rows[15]
    assert (decapod["thesis_fitness"], decapod["thesis_usable"]) == ("", "")
    jumps = rows_of(whole / "tables" / "table-5.2.csv")
    assert [row["generation"] for row in jumps[:3]] == ["60", "300", "300"]


def test_table_of_robustness(whole: Path) -> None:
    row = rows_of(whole / "tables" / "robustness.csv")[4]
    assert (row["worst"], row["median"], row["best"]) == ("10", "25", "40")
    assert float(row["spread"]) == pytest.approx((500 / 3) ** 0.5 / 25, rel=1e-5)
    assert (row["usable_runs"], row["judged_runs"]) == ("2", "4")
    assert float(row["worst_by_best_of_first_three"]) == pytest.approx(1 / 3, rel=1e-5)
    assert float(row["thesis_worst_by_best_of_three"]) == pytest.approx(72.27 / 136.93, rel=1e-5)


def test_table_of_runs_has_what_replays_measured(whole: Path) -> None:
    rows = rows_of(whole / "tables" / "runs.csv")
    # Three marks a run; two where the thesis's jumps are through within five minutes.
    assert len(rows) == 4 * (7 * 3 + 4 * 2 + 3 * 3)
    assert {row["legs_used"] for row in rows} == {"3/4"}
    assert {row["standing"] for row in rows} == {"yes", "no"}


def test_figures_are_svg_for_light_and_dark(whole: Path) -> None:
    for path in (whole / "figures").iterdir():
        svg = path.read_text()
        ElementTree.fromstring(svg)
        used = set(re.findall(r"(?:fill|stroke): (#[0-9a-f]{6})", svg))
        assert used <= set(DARK), "each colour has its dark one"
        assert "prefers-color-scheme:dark" in svg


# Unfinished, strange and wrong results ------------------------------------------------------


def test_unfinished_study(tmp_path: Path) -> None:
    """A case of two finished runs and one on its way, one without a run, twelve not begun."""
    begun = made_case("biped1", RUN, runs=3)
    last = begun["runs"][2]
    last["best"], last["marks"] = last["best"][:20], last["marks"][:1]
    none = made_case("apod", JUMP, runs=0)
    write_page(tmp_path, made_study([none, begun]))
    words = read(tmp_path).words
    assert "This study is not complete: 2 of 56 runs are finished" in words
    assert "Biped 1 running: 2 of 4 runs, 1 unfinished" in words
    assert "Apod jumping: 0 of 4 runs" in words
    assert "Decapod 2 jumping: 0 of 4 runs" in words
    assert "after 20" in words
    rows = [row for row in rows_of(tmp_path / "tables" / "table-5.1.csv") if row["judged_runs"]]
    assert [row["judged_runs"] for row in rows[3:6]] == ["3", "2", "2"]
    # The third run leads at the first mark; it has no later one, so the second does.
    assert [row["run"] for row in rows[3:6]] == ["3", "2", "2"]
    robustness = rows_of(tmp_path / "tables" / "robustness.csv")[1]
    assert (robustness["finished_runs"], robustness["worst_by_best_of_first_three"]) == ("2", "")
    assert sorted(p.name for p in (tmp_path / "figures").iterdir()) == [
        "best-run-narrow.svg",
        "best-run.svg",
        "biped1-run-all.svg",
        "biped1-run-first.svg",
    ]


def test_study_without_a_run(tmp_path: Path) -> None:
    written = write_page(tmp_path, made_study([]))
    assert all(path.is_file() for path in written)
    assert "No run has come to its end yet." in read(tmp_path).words
    assert not list(tmp_path.rglob("*.svg"))


def test_shorter_study_ends_at_its_own_end(tmp_path: Path) -> None:
    case = made_case("tetrapod1", RUN, runs=1)
    run = case["runs"][0]
    run["best"] = run["best"][:40]
    run["marks"] = [*run["marks"][:1], run["marks"][0] | {"generation": 40, "fitness": 9.0}]
    write_page(tmp_path, made_study([case], runs=1) | {"generations": 40})
    rows = rows_of(tmp_path / "tables" / "table-5.1.csv")[9:12]
    assert [row["fitness"] for row in rows] == ["0.5", "", "9"]
    assert rows[2]["generation"] == "40"


def test_fitness_below_zero(tmp_path: Path) -> None:
    case = made_case("biped2", RUN, runs=3)
    for run in case["runs"]:
        run["best"] = [-2.5] * GENERATIONS
        for mark in run["marks"]:
            mark["fitness"] = -2.5
    write_page(tmp_path, made_study([case]))
    assert "−2.50 m" in read(tmp_path).words
    row = rows_of(tmp_path / "tables" / "robustness.csv")[2]
    assert (row["best"], row["spread"], row["worst_by_best_of_first_three"]) == ("-2.5", "", "")


def test_text_is_escaped(tmp_path: Path) -> None:
    nasty = "<script>\"&'</script>$x$"
    case = made_case("biped1", RUN, runs=2)
    case |= {"name": nasty, "picture": nasty + ".png"}
    for mark in (mark for run in case["runs"] for mark in run["marks"]):
        mark |= {"reasons": [nasty], "judgement": {nasty: nasty}}
    study = made_study([case]) | {"version": nasty, "started": nasty, "settings": {nasty: nasty}}
    study["machine"] = dict.fromkeys(("cpu", "system", "load"), nasty) | {"cores": 1}
    write_page(tmp_path, study)
    assert "<script" not in (tmp_path / "index.html").read_text()
    assert nasty in "".join(read(tmp_path).text)
    for path in (tmp_path / "figures").iterdir():
        ElementTree.fromstring(path.read_text())


def test_pictures_outside_the_folder_are_not_shown(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4)).save(tmp_path / "outside.png")
    case = made_case("biped1", RUN, runs=1) | {"picture": "../outside.png"}
    write_page(tmp_path / "page", made_study([case]))
    assert "outside.png" not in " ".join(read(tmp_path / "page").links)


def test_same_bytes_twice(tmp_path: Path) -> None:
    study = made_study([made_case("decapod1", JUMP), made_case("apod", RUN)])
    first = write_page(tmp_path / "a", study)
    second = write_page(tmp_path / "b", study | {"cases": study["cases"][::-1]})
    assert [p.relative_to(tmp_path / "a") for p in first] == [
        p.relative_to(tmp_path / "b") for p in second
    ]
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes(), a.name
    assert not list(tmp_path.rglob(".*")), "nothing half written is left"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cases": [made_case("apod", RUN) | {"task": "swim"}]}, "no case 'apod' with task 'swim'"),
        ({"cases": [made_case("apod", RUN)] * 2}, "'apod' with 'run' twice"),
        ({"cases": [{"creature": "apod"}]}, "'task' is missing"),
        ({"cases": [made_case("apod", RUN) | {"runs": [{"seed": 1}]}]}, "'best' is missing"),
    ],
)
def test_wrong_results_are_refused(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        write_page(tmp_path, made_study([]) | change)
    assert not list(tmp_path.iterdir())


# Parts --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.421, "0.42 s"),
        (3.24, "3.2 s"),
        (60, "1 min"),
        (252, "4 min 12 s"),
        (3599.8, "1 h"),
        (150_000, "41 h 40 min"),
    ],
)
def test_duration(seconds: float, words: str) -> None:
    assert duration(seconds).replace("\u00a0", " ") == words


def test_labels_are_moved_apart_and_no_further() -> None:
    assert spread_out([0.0, 20.0], 10.0) == [0.0, 20.0]
    assert spread_out([5.0, 5.0, 40.0], 10.0) == [0.0, 10.0, 40.0]
    # The third pushes into the block of the first two: all three share one middle.
    assert spread_out([0.0, 0.0, 6.0], 10.0) == pytest.approx([-8.0, 2.0, 12.0])


def test_ratio_of_nothing() -> None:
    assert tables.ratio(1.0, 0.0) is None
    assert tables.ratio(-1.0, 2.0) == -0.5


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        (
            "upright in 83 % of the steps, 95 % are needed",
            "upright in … of the steps, … are needed",
        ),
        ("slow: -0.12 body lengths a second", "slow: … body lengths a second"),
        ("idle: leg front, leg 3", "idle: …"),
        ("idle: hip", "idle: …"),
        ("it never left the ground", "it never left the ground"),
    ],
)
def test_kind_of_a_reason(reason: str, kind: str) -> None:
    assert kind_of(reason) == kind


def test_runs_that_are_idle_in_different_parts_are_counted_together(tmp_path: Path) -> None:
    case = made_case("tetrapod1", RUN, runs=3)
    for run, parts in zip(case["runs"], ("leg front, leg 3", "leg back", "leg 2"), strict=True):
        for mark in run["marks"]:
            mark |= {"usable": False, "reasons": [f"idle: {parts}"]}
    write_page(tmp_path, made_study([case]))
    words = read(tmp_path).words
    assert "Why, most frequent first: idle: … (3)." in words
    assert "idle: leg 2" in words, "the card of the best run names the part"
