"""Files of creatures: checked, listed, drawn; and the schema that editors check them with."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from PIL import Image

from ambulo._core import Creature
from ambulo.creature import CreatureError, load_creature, parse_creature
from ambulo.starters import starter_creatures
from creature_runs import ambulo, said, text_of

SCHEMA = json.loads(
    (Path(__file__).parents[2] / "schema" / "creature.schema.json").read_text(encoding="utf-8")
)
SEEDS = ("apod", "biped1", "biped2", "decapod1", "decapod2", "tetrapod1", "tetrapod2")


def changed(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    creature = text_of("biped1")
    change(creature)
    return creature


def written(path: Path, creature: object) -> Path:
    path.write_text(json.dumps(creature))
    return path


# -- the schema -------------------------------------------------------------------------------


def test_the_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", starter_creatures())
def test_what_ships_is_good_by_the_schema_and_by_us(name: str) -> None:
    text = starter_creatures()[name].read_text(encoding="utf-8")
    jsonschema.validate(json.loads(text), SCHEMA)
    creature = Creature.parse(text)
    # And stays so, and itself, when it is written by us.
    jsonschema.validate(json.loads(creature.json()), SCHEMA)
    assert Creature.parse(creature.json()).hash == creature.hash


# What is wrong, and where we say it is.
BROKEN = [
    (lambda c: c.pop("joints"), "$"),
    (lambda c: c.update(colour="red"), "$.colour"),
    (lambda c: c["parts"][0].update(mass=3), "$.parts[0].mass"),
    (lambda c: c["parts"][2].update(position=[0.0]), "$.parts[2].position"),
    (lambda c: c["parts"][1].update(shape={"star": {"radius": 1.0}}), "$.parts[1].shape"),
    (lambda c: c["parts"][1].update(shape={"circle": {}}), "$.parts[1].shape"),
    (lambda c: c["joints"][1].update(torque="much"), "$.joints[1].torque"),
    (lambda c: c.update(sensors=["smell"]), "$.sensors[0]"),
    (lambda c: c["parts"][0].update(tags=["wing"]), "$.parts[0].tags[0]"),
    (lambda c: c.update(pairs=[["hip back"]]), "$.pairs[0]"),
]


@pytest.mark.parametrize(("change", "place"), BROKEN, ids=[place for _, place in BROKEN])
def test_what_is_no_creature_is_none_by_the_schema_nor_by_us(
    change: Callable[[dict[str, Any]], object], place: str, tmp_path: Path
) -> None:
    creature = changed(change)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(creature, SCHEMA)
    file = written(tmp_path / "broken.json", creature)
    (row,) = said(ambulo("creature", "check", file, "--json"), code=1)
    assert [problem["path"][: len(place)] for problem in row["problems"]] == [place]


# -- check ------------------------------------------------------------------------------------


def test_a_good_file_is_called_good_with_its_figures(tmp_path: Path) -> None:
    file = written(tmp_path / "mine.json", text_of("biped1"))
    run = ambulo("creature", "check", file)
    assert run.exit_code == 0
    assert f"{file}: good; Biped 1, 3 parts, 2 driven joints, 2 legs" in run.output
    (row,) = said(ambulo("creature", "check", file, "--json"))
    assert row["good"] and row["parts"] == 3 and row["joints"] == row["legs"] == 2
    creature = load_creature("biped1")
    assert row["hash"] == creature.hash
    assert row["mass_kg"] == pytest.approx(creature.facts()["mass"], abs=1e-3)


def test_everything_that_is_wrong_is_named_with_its_path(tmp_path: Path) -> None:
    creature = text_of("biped1")
    creature["joints"][1]["torque"] = -5.0
    creature["joints"][0]["child"] = "tail"
    creature["parts"][2]["density"] = 0.0
    file = written(tmp_path / "broken.json", creature)
    run = ambulo("creature", "check", file)
    assert run.exit_code == 1
    lines = run.output.splitlines()
    assert all(line.startswith(f"{file}: $.") for line in lines)
    (row,) = said(ambulo("creature", "check", file, "--json"), code=1)
    assert not row["good"] and row["file"] == str(file)
    found = {problem["path"]: problem["reason"] for problem in row["problems"]}
    assert {"$.joints[1].torque", "$.joints[0].child", "$.parts[2].density"} <= set(found)
    assert "tail" in found["$.joints[0].child"] and "-5" in found["$.joints[1].torque"]
    assert lines == [f"{file}: {path}: {reason}" for path, reason in found.items()]
    with pytest.raises(CreatureError, match=r"^mine: \$\..*\nmine: \$\.") as caught:
        parse_creature(json.dumps(creature), "mine")
    assert dict(caught.value.problems) == found


def test_of_several_files_each_is_looked_at(tmp_path: Path) -> None:
    """One that was missing hid what was wrong with the others."""
    broken = written(tmp_path / "broken.json", changed(lambda c: c.update(name=3)))
    missing = tmp_path / "missing.json"
    files = (missing, broken, "tetrapod2")
    rows = said(ambulo("creature", "check", *files, "--json"), code=1)
    assert [row["file"] for row in rows] == [str(file) for file in files]
    assert [row["good"] for row in rows] == [False, False, True]
    assert rows[0]["problems"][0]["path"] is None
    run = ambulo("creature", "check", *files)
    assert run.exit_code == 1
    first, second, third = run.output.splitlines()
    assert first.startswith(f"{missing}: no such file")
    assert second.startswith(f"{broken}: $.name: ")
    assert third.startswith("tetrapod2: good; Tetrapod 2")
    assert ambulo("creature", "check", "apod", "biped1").exit_code == 0
    assert ambulo("creature", "check").exit_code == 2


def test_a_file_that_is_not_utf_8_is_refused_once_and_clearly(tmp_path: Path) -> None:
    """The file and the path came twice, one inside the other."""
    file = tmp_path / "latin.json"
    file.write_bytes('{"name": "Bär"}'.encode("latin-1"))
    run = ambulo("creature", "check", file)
    assert run.exit_code == 1
    assert run.output == f"{file}: $: not UTF-8 (invalid continuation byte at 11)\n"
    (row,) = said(ambulo("creature", "check", file, "--json"), code=1)
    (problem,) = row["problems"]
    assert problem == {"path": "$", "reason": "not UTF-8 (invalid continuation byte at 11)"}
    with pytest.raises(CreatureError, match=r"latin\.json: \$: not UTF-8"):
        load_creature(file)


@pytest.mark.parametrize("text", ["", "{", "[]", '"biped1"', "null"])
def test_what_is_no_json_object_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "broken.json"
    file.write_text(text)
    run = ambulo("creature", "check", file)
    assert run.exit_code == 1 and run.output.startswith(f"{file}: $: "), run.output


# -- list -------------------------------------------------------------------------------------


def test_what_ships_is_listed() -> None:
    run = ambulo("creature", "list")
    assert run.exit_code == 0
    listed = [line.split()[0] for line in run.output.splitlines()]
    assert listed == list(starter_creatures()) and set(SEEDS) <= set(listed)
    rows = said(ambulo("creature", "list", "--json"))
    assert list(rows) == listed
    counts = {name: (rows[name]["legs"], rows[name]["joints"]) for name in SEEDS}
    assert counts == {
        "apod": (0, 6), "biped1": (2, 2), "biped2": (2, 4), "decapod1": (10, 10),
        "decapod2": (10, 20), "tetrapod1": (4, 4), "tetrapod2": (4, 8),
    }  # fmt: skip


def test_what_ships_is_known_by_its_name_and_another_name_lists_them() -> None:
    assert load_creature("apod").facts()["name"] == "Apod"
    with pytest.raises(FileNotFoundError, match="centipede: no such file") as caught:
        load_creature("centipede")
    assert all(name in str(caught.value) for name in SEEDS)


def test_a_file_goes_before_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path / "apod", text_of("biped1"))
    monkeypatch.chdir(tmp_path)
    assert load_creature("apod").facts()["name"] == "Biped 1"


# -- show -------------------------------------------------------------------------------------


def test_a_picture_has_the_size_that_is_asked_for_and_is_not_replaced(tmp_path: Path) -> None:
    picture = tmp_path / "biped.png"
    run = ambulo("creature", "show", "biped1", "-o", picture, "--size", "160x96")
    assert run.exit_code == 0 and run.output == f"wrote {picture}\n"
    with Image.open(picture) as image:
        assert image.format == "PNG" and image.size == (160, 96)
        colours = image.convert("RGB").getcolors(160 * 96)
        assert colours is not None and len(colours) > 3
    before = picture.read_bytes()
    again = ambulo("creature", "show", "apod", "-o", picture)
    assert again.exit_code == 1 and "exists; --overwrite replaces it" in again.output
    assert picture.read_bytes() == before
    assert ambulo("creature", "show", "apod", "-o", picture, "--overwrite").exit_code == 0
    assert picture.read_bytes() != before
    assert list(tmp_path.iterdir()) == [picture]


@pytest.mark.parametrize(
    ("size", "says"),
    [
        ("640", "expected WxH, as 640x400"),
        ("axb", "expected WxH, as 640x400"),
        ("1x2x3", "expected WxH, as 640x400"),
        ("63x100", "64 to 4096 a side"),
        ("100x4097", "64 to 4096 a side"),
        ("-100x100", "64 to 4096 a side"),
    ],
)
def test_a_size_that_cannot_be_is_wrong_usage(size: str, says: str, tmp_path: Path) -> None:
    run = ambulo("creature", "show", "biped1", "-o", tmp_path / "p.png", "--size", size)
    assert run.exit_code == 2 and f"--size {size}: {says}" in run.output
    assert not list(tmp_path.iterdir())


def test_a_broken_creature_is_not_drawn(tmp_path: Path) -> None:
    file = written(tmp_path / "broken.json", changed(lambda c: c["joints"].pop()))
    run = ambulo("creature", "show", file, "-o", tmp_path / "p.png")
    assert run.exit_code == 1 and f"Error: {file}: $." in run.output
    assert list(tmp_path.iterdir()) == [file]
