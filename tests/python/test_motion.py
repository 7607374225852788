"""Motion files from Python and from the command line."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from ambulo import _core
from ambulo._core import Clip, MotionFileError, motion_axes, read_motion, write_motion
from ambulo.cli.motion import motion
from ambulo.starters import FOLDER

# Left is +X, in centimetres; the left arm is raised, the right one hangs stretched to the side.
PERSON = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation
  JOINT LeftUpLeg
  {
    OFFSET 10 -5 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    JOINT LeftFoot
    {
      OFFSET 0 -80 0
      CHANNELS 3 Yrotation Xrotation Zrotation
      JOINT LeftToe
      {
        OFFSET 0 -5 15
        CHANNELS 3 Yrotation Xrotation Zrotation
        End Site
        {
          OFFSET 0 0 5
        }
      }
    }
  }
  JOINT RightUpLeg
  {
    OFFSET -10 -5 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    JOINT RightFoot
    {
      OFFSET 0 -80 0
      CHANNELS 3 Yrotation Xrotation Zrotation
      JOINT RightToe
      {
        OFFSET 0 -5 15
        CHANNELS 3 Yrotation Xrotation Zrotation
        End Site
        {
          OFFSET 0 0 5
        }
      }
    }
  }
  JOINT LeftArm
  {
    OFFSET 20 50 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    JOINT LeftHand
    {
      OFFSET 55 0 0
      CHANNELS 3 Yrotation Xrotation Zrotation
      End Site
      {
        OFFSET 10 0 0
      }
    }
  }
  JOINT RightArm
  {
    OFFSET -20 50 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    JOINT RightHand
    {
      OFFSET -55 0 0
      CHANNELS 3 Yrotation Xrotation Zrotation
      End Site
      {
        OFFSET -10 0 0
      }
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.016667
"""
LEGS = " 0 0 0" * 6
FRAMES = "".join(f"{x} 95 0 0 0 0{LEGS} 0 0 {90 - x} 0 0 0 0 0 0 0 0 0\n" for x in range(3))
PERSON += FRAMES

ASF = """:units
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    name lhumerus
    direction 1 0 0
    length 9
    axis 0 0 0 XYZ
    dof rz
  end
:hierarchy
  begin
    root lhumerus
  end
"""
AMC = ":DEGREES\n1\nroot 0 9 0 0 0 0\nlhumerus 90\n2\nroot 0 9 1 0 0 0\nlhumerus 80\n"

Run = Callable[..., Result]


@pytest.fixture
def run() -> Run:
    return lambda *args: CliRunner().invoke(motion, [str(arg) for arg in args])


@pytest.fixture
def person(tmp_path: Path) -> Path:
    path = tmp_path / "person.bvh"
    path.write_text(PERSON)
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files in two folders: two that are whole, one that is cut, one of no concern."""
    folder = tmp_path / "captures"
    (folder / "deep").mkdir(parents=True)
    (folder / "a.bvh").write_text(PERSON)
    (folder / "bad.bvh").write_text(PERSON.removesuffix(" 0\n"))
    (folder / "deep" / "02_01.amc").write_text(AMC)
    (folder / "deep" / "02.asf").write_text(ASF)
    (folder / "notes.txt").write_text("")
    return folder


def place(clip: Clip, name: str, frame: int = 0) -> np.ndarray:
    return clip.positions()[frame, clip.names.index(name)]


def tree(folder: Path) -> list[str]:
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


class TestClip:
    def test_what_a_file_holds(self, person: Path) -> None:
        clip, report = read_motion(person)
        assert clip.names[:2] == ["Hips", "LeftUpLeg"]
        assert clip.parents[:4] == [-1, 0, 1, 2]
        assert (clip.frames, clip.fps) == (3, 60.0)
        assert clip.duration == pytest.approx(2 / 60)
        assert clip.offsets.shape == (11, 3)
        assert clip.offsets[7].tolist() == [20, 50, 0]
        assert clip.rotations.shape == (3, 11, 4)
        assert np.allclose(clip.rotations[0, 7], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
        assert clip.translations[2, 0].tolist() == [2, 95, 0]
        assert clip.translations[2, 1].tolist() == [10, -5, 0]
        assert clip.positions().dtype == np.float32
        assert np.allclose(place(clip, "LeftHand"), [20, 200, 0], atol=1e-4)
        assert clip.tip_joints == [3, 6, 8, 10]
        assert clip.tips[2].tolist() == [10, 0, 0]
        assert repr(clip) == "<Clip: 3 frames at 60 fps, 11 joints>"
        assert report["format"] == "bvh"
        assert report["notes"] == []
        assert report["detected"]["axes"] == "cm"
        assert report["detected"]["up"] == "+Y"
        assert report["detected"]["forward"] == "+Z"
        assert report["detected"]["handedness"] == "right"

    def test_arrays_there_and_back(self, person: Path) -> None:
        clip, _ = read_motion(person)
        copy = Clip.from_arrays(
            names=clip.names,
            parents=clip.parents,
            offsets=clip.offsets,
            fps=clip.fps,
            rotations=clip.rotations,
            root=clip.translations[:, 0],
        )
        assert np.array_equal(copy.positions(), clip.positions())

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"parents": [-1]}, "2 names, 1 parents"),
            ({"parents": [-1, -1]}, "its parent must come before it"),
            ({"parents": [-1, -7]}, "its parent must come before it"),
            ({"names": ["a", "a"]}, "occurs twice"),
            ({"offsets": np.zeros((2, 2))}, "do not fit"),
            ({"rotations": np.zeros((4, 2, 3))}, r"rotations has the shape \[4, 2, 3\]"),
            ({"rotations": np.zeros((4, 2, 4))}, "frame 0, joint 0: .* rotation is zero"),
            ({"rotations": np.zeros((0, 2, 4)), "root": None}, "at least one frame"),
            ({"root": np.zeros((3, 3))}, r"root has the shape \[3, 3\], expected \(4, 3\)"),
            ({"fps": 0.0}, "frame time"),
        ],
    )
    def test_arrays_that_do_not_fit(self, change: dict[str, Any], message: str) -> None:
        right: dict[str, Any] = {
            "names": ["a", "b"],
            "parents": [-1, 0],
            "offsets": np.zeros((2, 3)),
            "fps": 30.0,
            "rotations": np.tile([0.0, 0.0, 0.0, 1.0], (4, 2, 1)),
            "root": np.zeros((4, 3)),
        }
        assert Clip.from_arrays(**right).frames == 4
        with pytest.raises(ValueError, match=message):
            Clip.from_arrays(**right | change)

    def test_mirrored_raises_the_other_hand(self, person: Path) -> None:
        clip, _ = read_motion(person)
        for method in ("auto", "name"):
            mirrored = clip.mirrored(method)
            assert np.allclose(place(mirrored, "RightHand"), [-20, 200, 0], atol=1e-4)
            assert np.allclose(place(mirrored, "LeftHand"), [75, 145, 0], atol=1e-4)
        with pytest.raises(ValueError, match="'LeftHand' has no partner on the other side"):
            clip.mirrored("geometry")  # A raised hand lies opposite to none.
        with pytest.raises(ValueError, match="expected auto, name or geometry"):
            clip.mirrored("magic")  # pyright: ignore[reportArgumentType]

    def test_resampled_and_sliced(self, person: Path) -> None:
        clip, _ = read_motion(person)
        assert clip.resampled(30).frames == 2
        assert clip.slice(1, 3).translations[0, 0].tolist() == [1, 95, 0]
        for wrong in (lambda: clip.resampled(0), lambda: clip.slice(2, 2)):
            with pytest.raises(ValueError):
                wrong()

    def test_written_and_read_again(self, person: Path, tmp_path: Path) -> None:
        clip, _ = read_motion(person)
        first, second = tmp_path / "1.bvh", tmp_path / "2.bvh"
        assert write_motion(first, clip) == []
        again, report = read_motion(first)
        assert report["notes"] == []
        assert np.allclose(again.positions(), clip.positions(), atol=1e-4)
        write_motion(second, again)
        assert first.read_bytes() == second.read_bytes()
        text = first.read_text()
        assert "Frame Time: 0.016667\n" in text
        assert "CHANNELS 3 Yrotation Xrotation Zrotation\n" in text

    def test_threads_read_at_once(self, person: Path) -> None:
        clips: list[Clip] = []
        threads = [
            threading.Thread(target=lambda: clips.append(read_motion(person)[0])) for _ in range(8)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert [clip.frames for clip in clips] == [3] * 8


class TestErrors:
    def test_a_refusal_says_where_and_why(self, person: Path) -> None:
        person.write_text(PERSON.removesuffix(" 0\n"))
        with pytest.raises(MotionFileError) as caught:
            read_motion(person)
        error = caught.value
        assert isinstance(error, ValueError)
        lines = PERSON.count("\n")
        assert (error.line, error.expected) == (lines, "36 numbers in frame 3")
        assert error.found == "35"
        start = f"{person}: line {lines}, column {error.column}: expected 36 numbers"
        assert str(error).startswith(start)

    def test_paths_that_cannot_be_used(self, tmp_path: Path, person: Path) -> None:
        with pytest.raises(FileNotFoundError, match=r"none\.bvh"):
            read_motion(tmp_path / "none.bvh")
        with pytest.raises(MotionFileError, match="not a motion file by its suffix") as caught:
            read_motion(tmp_path / "a.fbx")
        assert caught.value.line is None
        (tmp_path / "a.amc").write_text(AMC)
        with pytest.raises(MotionFileError, match="found no skeleton"):
            read_motion(tmp_path / "a.amc")
        clip, _ = read_motion(person)
        with pytest.raises(MotionFileError, match=r"known: \.bvh"):
            write_motion(tmp_path / "a.amc", clip)
        with pytest.raises(FileNotFoundError):
            write_motion(tmp_path / "none" / "a.bvh", clip)

    def test_options_that_are_none(self, person: Path) -> None:
        with pytest.raises(ValueError, match="expected replace or add"):
            read_motion(person, positions="guess")  # pyright: ignore[reportArgumentType]
        with pytest.raises(ValueError, match="fps is 0"):
            read_motion(person, fps=0)
        clip, _ = read_motion(person)
        with pytest.raises(ValueError, match=r"unknown axes 'quake'; known: .*unreal"):
            clip.converted("cm", "quake")

    def test_repair_is_said(self, person: Path) -> None:
        person.write_text(PERSON.removesuffix(" 0\n"))
        clip, report = read_motion(person, repair=True)
        assert clip.frames == 2
        assert "repaired: cut after frame 2" in report["notes"][0]


# Unit vectors up, forward and to the left, and metres a unit, as the hosts publish them.
HOSTS = {
    "unity": ([0, 1, 0], [0, 0, 1], [-1, 0, 0], 1.0),
    "unreal": ([0, 0, 1], [1, 0, 0], [0, -1, 0], 0.01),
    "blender": ([0, 0, 1], [0, -1, 0], [1, 0, 0], 1.0),
    "godot": ([0, 1, 0], [0, 0, -1], [-1, 0, 0], 1.0),
    "gltf": ([0, 1, 0], [0, 0, 1], [1, 0, 0], 1.0),
}


class TestConvert:
    @pytest.mark.parametrize("host", HOSTS)
    def test_the_left_hand_stays_the_left_hand(
        self, run: Run, person: Path, tmp_path: Path, host: str
    ) -> None:
        out = tmp_path / "out" / f"{host}.bvh"
        result = run("convert", person, out, "--from-axes", "cm", "--axes", host)
        assert result.exit_code == 0, result.output
        clip, _ = read_motion(out)
        up, forward, left, unit = (np.array(part) for part in HOSTS[host])
        raised = (place(clip, "LeftHand") - place(clip, "LeftArm")) * unit
        hanging = (place(clip, "RightHand") - place(clip, "RightArm")) * unit
        toe = (place(clip, "LeftToe") - place(clip, "LeftFoot")) * unit
        assert np.allclose(raised, 0.55 * up, atol=1e-4)
        assert np.allclose(hanging, -0.55 * left, atol=1e-4)
        assert np.allclose(toe, 0.15 * forward - 0.05 * up, atol=1e-4)
        arm = place(clip, "LeftArm") - place(clip, "Hips")
        assert arm @ left * unit == pytest.approx(0.2, abs=1e-4)

    def test_a_guess_of_the_axes_is_named(self, run: Run, person: Path, tmp_path: Path) -> None:
        said, guessed = tmp_path / "said.bvh", tmp_path / "guessed.bvh"
        assert run("convert", person, said, "--from-axes", "cm", "--axes", "unity").exit_code == 0
        result = run("convert", person, guessed, "--axes", "unity")
        assert result.exit_code == 0
        assert "note: taken for cm; --from-axes says otherwise" in result.output
        assert guessed.read_bytes() == said.read_bytes()
        plain = run("convert", person, tmp_path / "plain.bvh")
        assert "taken for" not in plain.output

    def test_axes_that_cannot_be_told_must_be_said(self, run: Run, tmp_path: Path) -> None:
        chain = tmp_path / "chain.bvh"
        chain.write_text(
            "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Yrotation Xrotation\n"
            "End Site\n{\nOFFSET 1 0 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n"
        )
        out = tmp_path / "o.bvh"
        result = run("convert", chain, out, "--axes", "unity")
        assert result.exit_code == 1 and not out.exists()
        assert "chain.bvh: its axes and unit cannot be told; name --from-axes" in result.output
        assert run("convert", chain, out, "--axes", "unity", "--from-axes", "cm").exit_code == 0

    def test_a_file_into_a_folder(self, run: Run, folder: Path, tmp_path: Path) -> None:
        (tmp_path / "out").mkdir()
        amc = folder / "deep" / "02_01.amc"
        result = run("convert", amc, tmp_path / "out", "--amc-fps", 60, "--fps", 30)
        assert result.exit_code == 0, result.output
        clip, _ = read_motion(tmp_path / "out" / "02_01.bvh")
        assert (clip.fps, clip.frames) == (30.0, 1)
        assert np.allclose(place(clip, "root"), [0, 20, 0])
        assert "note: AMC stores no frame rate: taken for 60 frames a second" in result.output

    def test_mirrored(self, run: Run, person: Path, tmp_path: Path) -> None:
        assert run("convert", person, tmp_path / "m.bvh", "--mirror").exit_code == 0
        clip, _ = read_motion(tmp_path / "m.bvh")
        assert np.allclose(place(clip, "RightHand"), [-20, 200, 0], atol=1e-3)

    def test_a_folder_keeps_its_tree_and_one_bad_file_stops_nothing(
        self, run: Run, folder: Path, tmp_path: Path
    ) -> None:
        out = tmp_path / "out"
        result = run("convert", folder, out)
        assert result.exit_code == 1
        assert tree(out) == ["a.bvh", "deep/02_01.bvh"]
        assert "1 of 3 files failed" in result.stderr
        assert f"Error: {folder / 'bad.bvh'}: line " in result.stderr
        repaired = run("convert", folder, out, "--repair", "--overwrite")
        assert repaired.exit_code == 0, repaired.output
        assert "repaired: cut after frame 2" in repaired.output
        assert tree(out) == ["a.bvh", "bad.bvh", "deep/02_01.bvh"]

    def test_a_dry_run_writes_nothing(self, run: Run, folder: Path, tmp_path: Path) -> None:
        before = tree(tmp_path)
        result = run("convert", folder, tmp_path / "out", "--dry-run", "--json")
        assert result.exit_code == 1, "it finds the bad file all the same"
        entries = json.loads(result.stdout)
        assert [Path(entry["input"]).name for entry in entries] == ["a.bvh", "bad.bvh", "02_01.amc"]
        assert [("error" in entry) for entry in entries] == [False, True, False]
        assert entries[0]["frames"] == 3
        assert tree(tmp_path) == before

    def test_nothing_is_written_over_unasked(self, run: Run, person: Path, tmp_path: Path) -> None:
        out = tmp_path / "out.bvh"
        out.write_text("precious")
        result = run("convert", person, out)
        assert result.exit_code == 1
        assert "exists; --overwrite replaces it" in result.stderr
        assert out.read_text() == "precious"
        assert run("convert", person, out, "--overwrite").exit_code == 0
        assert read_motion(out)[0].frames == 3

    def test_an_input_is_never_written_over(
        self, run: Run, folder: Path, person: Path, tmp_path: Path
    ) -> None:
        os.link(person, tmp_path / "same.bvh")
        for out in (person, tmp_path / "same.bvh"):
            result = run("convert", person, out, "--overwrite")
            assert result.exit_code == 1
            assert "is an input" in result.stderr
        result = run("convert", folder, folder, "--overwrite", "--repair")
        assert result.exit_code == 1
        assert (folder / "a.bvh").read_text() == PERSON
        assert person.read_text() == PERSON

    def test_an_input_is_known_by_a_way_round_too(
        self, run: Run, person: Path, tmp_path: Path
    ) -> None:
        # The folder `new` does not exist before it is made for the output.
        result = run("convert", person, tmp_path / "new" / ".." / "person.bvh", "--mirror")
        assert result.exit_code == 1 and "is an input" in result.stderr
        assert person.read_text() == PERSON

    def test_what_exists_is_named_a_few_times_only(
        self, run: Run, folder: Path, tmp_path: Path
    ) -> None:
        for path in folder.rglob("*"):
            if path.is_file():
                path.unlink()
        for number in range(8):
            (folder / f"{number}.bvh").write_text(PERSON)
        assert run("convert", folder, tmp_path / "out").exit_code == 0
        lines = run("convert", folder, tmp_path / "out").stderr.splitlines()
        assert [line.startswith("Error: ") for line in lines] == [True] * 5 + [False] * 2
        assert lines[5:] == ["… and 3 more", "8 of 8 files failed"]
        # One that fails in another way: all are named.
        (folder / "9.bvh").write_text("nothing")
        assert run("convert", folder, tmp_path / "out").stderr.count("Error: ") == 9

    @pytest.mark.parametrize("as_json", [False, True])
    def test_ctrl_c_tells_what_was_done(
        self, run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, as_json: bool
    ) -> None:
        def write(path: str, clip: Clip) -> list[str]:
            notes = write_motion(path, clip)
            signal.raise_signal(signal.SIGINT)
            return notes

        monkeypatch.setattr(_core, "write_motion", write)
        out = tmp_path / "out"
        result = run("convert", folder, out, *["--json"] * as_json)
        assert result.exit_code == 130
        assert result.stderr == "stopped after 1 of 3 files\n"
        assert tree(out) == ["a.bvh"]
        if as_json:
            assert [entry["output"] for entry in json.loads(result.stdout)] == [str(out / "a.bvh")]
        else:
            assert result.stdout == f"wrote {out / 'a.bvh'} (3 frames at 60 fps)\n"
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def test_two_inputs_do_not_share_an_output(
        self, run: Run, folder: Path, tmp_path: Path
    ) -> None:
        (folder / "deep" / "02_01.bvh").write_text(PERSON)
        result = run("convert", folder / "deep", tmp_path / "out")
        assert result.exit_code == 1
        assert "is the output of another input too" in result.stderr
        assert tree(tmp_path / "out") == ["02_01.bvh"]

    def test_wrong_usage(self, run: Run, folder: Path, person: Path, tmp_path: Path) -> None:
        (tmp_path / "empty").mkdir()
        for args in (
            ("convert", tmp_path / "none", tmp_path / "out"),
            ("convert", tmp_path / "empty", tmp_path / "out"),
            ("convert", person, tmp_path / "out.fbx"),
            ("convert", folder, person),
            ("convert", person, tmp_path / "out.bvh", "--fps", "0"),
            ("convert", person, tmp_path / "out.bvh", "--axes", "quake"),
            ("info", tmp_path / "none"),
        ):
            assert run(*args).exit_code == 2, args


class TestInfo:
    def test_of_a_file(self, run: Run, person: Path) -> None:
        result = run("info", person)
        assert result.exit_code == 0
        assert result.stdout == (
            "person.bvh: 3 frames at 60 fps (0.05 s), 11 joints\n"
            "  seems: axes like cm, up +Y in 100% of frames, forward +Z in 100% of frames, "
            "unit 0.01 m\n"
        )
        entry = json.loads(run("info", person, "--json").stdout)
        assert (entry["input"], entry["joints"]) == (str(person), 11)

    def test_of_a_folder(self, run: Run, folder: Path) -> None:
        result = run("info", folder)
        assert result.exit_code == 1
        assert "bad.bvh: cannot be read" in result.stdout
        assert "deep/02_01.amc: 2 frames at 120 fps" in result.stdout
        assert "1 of 3 files failed" in result.stderr
        result = run("info", folder, "--repair", "--json")
        assert result.exit_code == 0
        assert [entry["frames"] for entry in json.loads(result.stdout)] == [3, 2, 2]

    def test_of_what_is_not_a_regular_file(self, run: Run, tmp_path: Path) -> None:
        pipe = tmp_path / "pipe.bvh"
        os.mkfifo(pipe)
        for path in (pipe, Path("/dev/zero")):
            for args in (("info", path), ("convert", path, tmp_path / "out.bvh")):
                result = run(*args)
                assert result.exit_code == 2 and f"{path}: not a regular file" in result.stderr


class TestKeys:
    CLIPS = FOLDER / "clips"

    def test_a_clip_by_hand_is_read_and_told(self, run: Run) -> None:
        clip, report = read_motion(self.CLIPS / "sit.keys")
        assert clip.fps == pytest.approx(60.0) and report["metres_per_unit"] == 1.0
        assert report["phases"][1] == ("hold", 1.9, 4.3, True)
        assert ("seat", 1.2) in report["events"]
        assert report["axes"] == "ambulo"
        told = run("info", self.CLIPS / "sit.keys").stdout
        assert "phase hold: 1.9 to 4.3 s, loops" in told and "event seat: 1.2 s" in told

    def test_a_folder_becomes_bvh(self, run: Run, tmp_path: Path) -> None:
        result = run("convert", self.CLIPS, tmp_path / "out", "--axes", "ambulo", "--json")
        assert result.exit_code == 0
        assert not any("taken for" in str(entry["notes"]) for entry in json.loads(result.stdout))
        assert {entry["joints"] for entry in json.loads(result.stdout)} == {22}
        right, _ = read_motion(tmp_path / "out" / "open_door_right.bvh")
        left, _ = read_motion(tmp_path / "out" / "open_door_left.bvh")
        hand = right.names.index("RightHand"), left.names.index("LeftHand")
        at, other = right.positions()[45, hand[0]], left.positions()[45, hand[1]]
        assert np.allclose(at * [-1, 1, 1], other, atol=1e-4)

    def test_a_mistake_is_named(self, run: Run, tmp_path: Path) -> None:
        (tmp_path / "a.keys").write_text("keys 1\nskeleton b.skeleton\nkey 0\n")
        result = run("info", tmp_path / "a.keys")
        assert result.exit_code == 1
        assert "a.keys: line 2, column 10: expected a file beside" in result.stderr
        (tmp_path / "b.skeleton").write_text("keys 1\nbone a - 0 0\n")
        result = run("info", tmp_path / "a.keys")
        assert "b.skeleton: line 2, column 13: expected metres from the parent" in result.stderr


def test_the_hosts_are_all_known() -> None:
    assert set(HOSTS) <= set(motion_axes())
