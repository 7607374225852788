"""Scenes from files, visits, and the commands that play and check them."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from ambulo import Model, _core, load_model
from ambulo.cli import cli
from ambulo.evaluate.adding import THINGS, add_interactions, scene_text, script_text
from ambulo.evaluate.visit_outputs import interactions, moments, reels
from ambulo.evaluate.visits import MEASURES, summarise
from ambulo.scene import (
    Happened,
    SceneError,
    SceneFiles,
    Visited,
    gather,
    kind_of,
    load_scene,
    load_script,
    run_visit,
    visit_seeds,
)
from ambulo.starters import FOLDER, starter_model, starter_scene

SCRIPT = script_text(1) + "\n[interruptions]\nmost = 1\nwithin = 4.0\n"


@pytest.fixture(scope="module")
def person() -> Model:
    return load_model(starter_model())


@pytest.fixture(scope="module")
def chair() -> SceneFiles:
    """A chair to sit on, and three things that nobody can use."""
    return gather(scene_text(1), FOLDER / "scenes" / "none.toml")


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """The same as files: scene and script in `scenes`, the rest beside that folder."""
    for folder in ("scenes", "interactions", "clips"):
        (tmp_path / folder).mkdir()
    shutil.copy(FOLDER / "interactions" / "sit.toml", tmp_path / "interactions")
    for clip in ("sit.keys", "human.skeleton"):
        shutil.copy(FOLDER / "clips" / clip, tmp_path / "clips")
    scene = tmp_path / "scenes" / "room.toml"
    scene.write_text(scene_text(1))
    (tmp_path / "scenes" / "room-visit.toml").write_text(SCRIPT)
    return scene


def ambulo(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


# Visits -------------------------------------------------------------------------------------


def test_a_visit_is_recorded_frame_by_frame(person: Model, chair: SceneFiles) -> None:
    shares: list[float] = []
    recording, visit = run_visit(person, chair, SCRIPT, progress=shares.append)
    assert visit["measured"]["ended"] == visit["measured"]["sits"] == 1
    assert shares and shares[-1] == 1.0
    assert recording.frames == round(60 * visit["measured"]["seconds"]) + 1
    story = [one["what"] for one in visit["happened"]]
    assert story == ["walks", "enters", "holds", "exits", "ended"]
    held = visit["happened"][2]["time"] + 0.5
    assert recording.event_at(held) == "sit: holds"
    # On the seat, and the mark of where the hips should be is there, too.
    seat = next(part for part in recording.parts if part.object == "chair")
    hips = recording.character.positions[round(held * 60), 0]
    off = recording.targets_at(held * 60)[0] - hips
    assert np.abs(off).max() < 0.1
    assert np.hypot(*(hips - seat.transforms[:3])[[0, 2]]) < 0.25 and 0.45 < hips[1] < 0.65
    leaf = next(part for part in recording.parts if part.part == "leaf")
    assert leaf.moves and len(leaf.grips) == 2 and len(recording.parts) == 6
    assert recording.heights.height(np.zeros((2, 3)), np.ones((2, 3))).shape == (2, 3)


def test_the_same_seed_gives_the_same_numbers_on_any_number_of_threads(
    person: Model, chair: SceneFiles
) -> None:
    seeds = [5, 0, 3, 1]
    over: list[int] = []
    one = visit_seeds(person, chair, SCRIPT, seeds)
    more = visit_seeds(person, chair, SCRIPT, seeds, threads=4, progress=over.append)
    assert one == more and [visit["seed"] for visit in one] == seeds and over[-1] == 4
    assert one[1] == run_visit(person, chair, SCRIPT, 0)[1]
    assert len({json.dumps(visit["happened"]) for visit in one}) == 4


def test_what_progress_raises_stops_the_visits(person: Model, chair: SceneFiles) -> None:
    def stop(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        visit_seeds(person, chair, SCRIPT, range(10_000), threads=2, progress=stop)


def test_interactions_are_added_without_touching_the_model(person: Model) -> None:
    rows = add_interactions(person, FOLDER)
    assert [row["interactions"] for row in rows] == [1, 2, 3, 4] == list(range(1, len(THINGS) + 1))
    for row in rows:
        assert row["played"] == row["interactions"] == row["clips"] and not row["undone"]
        assert row["inputs_before"] == row["inputs_after"] == person.inputs
        assert row["weights_before"] == row["weights_after"]


def test_a_model_without_hands_is_refused(chair: SceneFiles) -> None:
    from conftest import follower

    with pytest.raises(ValueError, match=r"hands|arms|head"):
        run_visit(follower("ambulo"), chair, SCRIPT)


# What came of them --------------------------------------------------------------------------


def test_mean_and_worst_of_several_visits(person: Model, chair: SceneFiles) -> None:
    visits = visit_seeds(person, chair, SCRIPT, range(3), threads=2)
    rows = {row["measure"]: row for row in summarise(visits)}
    assert len(rows) == len(MEASURES)
    depth = [visit["measured"]["penetration_cm"]["most"] for visit in visits]
    row = rows["penetration"]
    assert row["first"] == depth[0] and row["worst"] == max(depth)
    assert row["worst_seed"] == int(np.argmax(depth)) and row["mean"] == pytest.approx(
        sum(depth) / 3
    )
    assert row["met"] is (max(depth) <= 1.0)
    # Nobody used a hand: nothing was measured, so nothing is met or missed.
    assert rows["hand to handle"]["met"] is None and rows["hand to handle"]["worst"] is None


def told(*events: tuple[float, str, str]) -> list[Happened]:
    return [{"time": t, "what": what, "object": "o", "interaction": one} for t, what, one in events]


def test_a_film_shows_the_first_of_a_kind_that_was_whole() -> None:
    happened = told(
        (1.0, "walks", "a.toml"), (2.0, "enters", "a.toml"), (3.0, "broken", "a.toml"),
        (4.0, "walks", "a.toml"), (5.0, "enters", "a.toml"), (6.0, "holds", "a.toml"),
        (6.2, "exits", "a.toml"), (8.0, "ended", "a.toml"), (9.0, "walks", "b.toml"),
        (9.5, "gave up: Blocked", "b.toml"), (10.0, "walks", "b.toml"), (11.0, "enters", "b.toml"),
    )  # fmt: skip
    visit: Visited = {"seed": 0, "measured": {}, "happened": happened}
    assert [len(story) for story in interactions(happened)] == [2, 4, 1]
    assert [reel.file for reel in reels(visit, "gif", 12.0)] == ["film-02-a.gif", "film-03-b.gif"]
    every = reels(visit, "gif", 12.0, every=True)
    assert len(every) == 3 and every[0].title.endswith("(broken off)")
    assert every[1].start == 4.0 and every[1].stop == pytest.approx(8.7)
    assert moments(visit) == pytest.approx([2.5, 6.1, 11.0])


def test_a_cut_keeps_its_time(person: Model, chair: SceneFiles) -> None:
    recording, visit = run_visit(person, chair, SCRIPT)
    start = visit["happened"][1]["time"] + 0.5
    cut = recording.cut(start, start + 1.0)
    assert cut.frames == 61 and cut.began == pytest.approx(start, abs=0.01)
    assert cut.event_at(0.0) == "sit: enters" == recording.event_at(start)
    frame = round(start * 60)
    assert (cut.character.positions[0] == recording.character.positions[frame]).all()
    assert cut.cut(0.5, 9.0).began == pytest.approx(start + 0.5, abs=0.01)


# Files --------------------------------------------------------------------------------------


def test_what_a_scene_names_is_found_beside_it_or_next_to_its_folder(small: Path) -> None:
    files = load_scene(small)
    assert files.sources["sit.toml"].parent.resolve() == small.parents[1] / "interactions"
    shutil.move(small.parents[1] / "interactions" / "sit.toml", small.parent)
    assert load_scene(small).sources["sit.toml"] == small.parent / "sit.toml"
    assert set(load_scene(small).clips) == {"sit.keys"}


def test_each_missing_file_is_named_where_it_is_asked_for(small: Path) -> None:
    (small.parents[1] / "clips" / "sit.keys").unlink()
    with pytest.raises(SceneError, match=r"sit\.toml:\d+:\d+: \$\.clip\.file: there is no"):
        load_scene(small)
    (small.parents[1] / "interactions" / "sit.toml").unlink()
    with pytest.raises(SceneError) as caught:
        load_scene(small)
    (problem,) = caught.value.problems
    line = small.read_text().splitlines()[(problem.line or 0) - 1]
    assert problem.path == "$.object[0].interactions[0]" and "sit.toml" in line


BAD = [
    ("spawn = { place = [0.0, 0.0] }", "spawn = { place = [0.0, nan] }", r":3:\d+: \$\.spawn"),
    ("format = 1", "format = 2", r":1:10: \$\.format: this is format 2"),
    ("format = 1", "format = ", r":1:\d+: \$: "),
    ('name = "chair"', 'name = "chair"\ncolour = 1', r":12:1: \$\.object\[0\]\.colour: unknown"),
    ("mass = 40.0", "mass = -1.0", r":35:\d+: \$\.object\[3\]\.kind\.box\.mass: -1 is not"),
    ('["sit.toml"]', '["../sit.toml"]', r":12:\d+: \$\.object\[0\]\.interactions\[0\]: '\.\./sit"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), BAD, ids=[said for _, _, said in BAD])
def test_a_malformed_scene_is_refused_with_path_and_line(
    small: Path, old: str, new: str, said: str
) -> None:
    assert old in scene_text(1)
    small.write_text(scene_text(1).replace(old, new, 1))
    run = ambulo("scene", "check", small)
    assert run.exit_code == 1 and re.search(r"room\.toml" + said, run.output), run.output
    run = ambulo("scene", "run", small, "-o", small.parent / "out")
    assert run.exit_code == 1 and not (small.parent / "out").exists()


def test_all_problems_of_all_files_are_said(small: Path) -> None:
    sit = small.parents[1] / "interactions" / "sit.toml"
    sit.write_text(
        sit.read_text().replace("distance = 0.1", "distance = -1").replace("end = 5.9", "end = 1")
    )
    script = small.with_name("room-visit.toml")
    script.write_text(SCRIPT.replace('use = "chair"', 'use = "throne"\nwith = 3'))
    long = small.with_name("long.toml")
    long.write_text("#" * (1 << 19))
    latin = small.with_name("latin.toml")
    latin.write_bytes('format = 1\nname = "Stühle"\n'.encode("latin-1"))
    missing = small.with_name("missing.toml")
    run = ambulo("scene", "check", small, sit, script, long, latin, missing, "--json")
    rows = {Path(row["file"]).name: row for row in json.loads(run.stdout)}
    assert run.exit_code == 1 and not any(row["good"] for row in rows.values())
    found = {name: [one["path"] for one in row["problems"]] for name, row in rows.items()}
    assert "$.approach.distance" in found["sit.toml"] and len(found["sit.toml"]) > 1
    assert found["room.toml"] == found["sit.toml"]
    assert all(one["line"] for one in rows["sit.toml"]["problems"])
    assert rows["latin.toml"]["problems"][0]["line"] == 2
    assert "at most" in rows["long.toml"]["problems"][0]["reason"]
    assert "No such file" in rows["missing.toml"]["problems"][0]["reason"]


def test_a_script_is_held_to_its_scene(small: Path) -> None:
    script = small.with_name("room-visit.toml")
    script.write_text(SCRIPT.replace('use = "chair"', 'use = "throne"'))
    with pytest.raises(
        SceneError, match=r"room-visit\.toml:5:\d+: \$\.do\[0\]\.use: the scene has"
    ):
        load_script(script, load_scene(small))
    assert ambulo("scene", "check", script).exit_code == 0
    assert ambulo("scene", "run", small, "-o", small.parent / "out").exit_code == 1


def test_an_interaction_of_another_kind_is_refused(small: Path) -> None:
    sit = small.parents[1] / "interactions" / "sit.toml"
    shutil.copy(FOLDER / "interactions" / "press_button.toml", sit)
    shutil.copy(FOLDER / "clips" / "press_button.keys", small.parents[1] / "clips")
    with pytest.raises(SceneError, match=r":12:\d+: .*is for a button, this is a chair"):
        load_scene(small)


def test_what_ships_is_good() -> None:
    files = [*(FOLDER / "scenes").glob("*.toml"), *(FOLDER / "interactions").glob("*.toml")]
    run = ambulo("scene", "check", *files)
    assert run.exit_code == 0 and run.output.count(": good; ") == len(files)
    assert {kind_of(file.read_text()) for file in files} == {"scene", "interaction", "script"}


def test_the_native_module_says_what_is_wrong() -> None:
    with pytest.raises(_core.SceneFileError) as caught:
        _core.read_script('format = 1\nname = ""\ndo = []')
    assert [path for path, _ in caught.value.problems] == ["$.name", "$.do"]
    assert _core.document_place("a = 1\nb = [2, 3]", "$.b[1]") == (2, 9)


# The command --------------------------------------------------------------------------------


def test_a_visit_is_written(small: Path) -> None:
    out = small.parent / "out"
    run = ambulo("scene", "run", small, "-o", out, "--size", "96x64")
    assert run.exit_code == 0, run.output
    report = json.loads((out / "visit.json").read_text())
    assert report["files"] == ["plan.png", "strip.png", "film-01-sit.gif"]
    assert {path.name for path in out.iterdir()} == {*report["files"], "visit.json"}
    assert report["weights"]["sha256_before"] == report["weights"]["sha256_after"]
    with Image.open(out / "film-01-sit.gif") as film:
        assert film.size == (96, 64) and getattr(film, "n_frames", 1) > 30
    assert "no weight changed" in run.output and "✓" in run.output
    assert all(f"wrote {out / name}" in run.output for name in report["files"])

    again = ambulo("scene", "run", small, "-o", out, "--no-film")
    assert again.exit_code == 1 and "--overwrite" in again.output
    (out / "mine.txt").write_text("stays")
    run = ambulo(
        "scene", "run", small, "-o", out, "--no-film", "--seeds", 2, "--overwrite", "--json"
    )
    report = json.loads(run.stdout)
    assert [visit["seed"] for visit in report["visits"]] == [0, 1, 2]
    assert report["files"] == ["plan.png", "strip.png"] and (out / "mine.txt").is_file()
    assert not list(out.glob("film*"))


def test_a_part_is_filmed(small: Path) -> None:
    out = small.parent / "out"
    arguments = ("--film-from", 1, "--film-to", 2, "--size", "64x64", "--fps", 20, "--seed", 3)
    run = ambulo("scene", "run", small, "-o", out, *arguments)
    assert run.exit_code == 0, run.output
    with Image.open(out / "film.gif") as film:
        assert getattr(film, "n_frames", 1) == 20
    assert json.loads((out / "visit.json").read_text())["visits"][0]["seed"] == 3


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--seed", 1, "--seeds", 2), "name one of them"),
        (("--whole", "--film-to", 2), "name one of them"),
        (("--film-from", 3, "--film-to", 2), "must come before"),
        (("--fps", 30), "divisor of 100"),
        (("--size", "9x9"), "64 to 4096"),
        (("--size", "big"), "expected WxH"),
    ],
)
def test_wrong_usage_is_said(small: Path, arguments: tuple[object, ...], said: str) -> None:
    run = ambulo("scene", "run", small, "-o", small.parent / "out", *arguments)
    assert run.exit_code == 2 and said in run.output
    assert not (small.parent / "out").exists()


def test_a_dry_run_writes_nothing(small: Path) -> None:
    out = small.parent / "out"
    run = ambulo("scene", "run", small, "-o", out, "--dry-run")
    assert run.exit_code == 0 and "dry run: would play seed 0" in run.output
    assert not out.exists()


def test_the_examples_of_the_help_are_good(tmp_path: Path) -> None:
    text = ambulo("scene", "run", "--help").output
    examples = [line.split()[1:] for line in text.splitlines() if line.startswith("    ambulo")]
    shipped = [words for words in examples if "my_scene.toml" not in words]
    assert len(examples) == 4 and len(shipped) == 3
    for number, words in enumerate(shipped):
        words[words.index("-o") + 1] = str(tmp_path / str(number))
        run = ambulo(*words, "--dry-run")
        assert run.exit_code == 0 and str(starter_scene()) in run.output, run.output


def test_ctrl_c_while_visiting_writes_nothing(small: Path) -> None:
    timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    run = ambulo("scene", "run", small, "-o", small.parent / "out", "--seeds", 100_000)
    timer.join()
    assert run.exit_code == 130 and "stopped" in run.output
    assert not (small.parent / "out").exists()


def test_ctrl_c_while_filming_leaves_whole_files(small: Path) -> None:
    out = small.parent / "out"
    arguments = ["scene", "run", str(small), "-o", str(out), "--size", "1600x1200"]
    command = [sys.executable, "-m", "ambulo", *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        patience = time.monotonic() + 300.0
        while not list(out.glob(".film*.part")) and time.monotonic() < patience:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=60.0)[1]
    assert process.returncode == 130 and "stopped" in errors and "Traceback" not in errors
    report = json.loads((out / "visit.json").read_text())
    assert report["files"] == ["plan.png", "strip.png"]
    assert {path.name for path in out.iterdir()} == {"visit.json", "plan.png", "strip.png"}
