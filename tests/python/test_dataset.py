"""`ambulo dataset`: from motion files to rows, on made and on real recordings."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import _core, write_motion
from ambulo.cli import cli
from ambulo.starter_motion import clips

HOLDEN = ("LocomotionFlat04_000", "LocomotionFlat09_000", "NewCaptures10_000")


def ambulo(*arguments: object, code: int = 0) -> str:
    """Run a command in this process; returns everything that it said."""
    run = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert run.exit_code == code, run.output
    return run.output


def build(*arguments: object, code: int = 0) -> str:
    return ambulo("dataset", "build", *arguments, code=code)


def info(folder: Path) -> dict[str, Any]:
    return json.loads(ambulo("dataset", "info", folder, "--json"))


def started(*arguments: object) -> subprocess.Popen[str]:
    """A build in a process of its own, to be stopped or measured."""
    command = [sys.executable, "-m", "ambulo", "dataset", "build", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def written(folder: Path) -> dict[str, bytes]:
    """Every file of a data set."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def numbers(folder: Path) -> list[np.ndarray]:
    """All rows, shard by shard, held to what the index says of them."""
    index = json.loads((folder / "dataset.json").read_bytes())
    width = sum(size for _, size in index["columns"])
    shards = [np.load(folder / clip["file"], mmap_mode="r") for clip in index["clips"]]
    for shard, clip in zip(shards, index["clips"], strict=True):
        assert shard.shape == (clip["rows"], width) and shard.dtype == np.float32
        assert np.isfinite(shard).all()
    return shards


def takes(folder: Path) -> dict[str, set[str]]:
    """Takes of each side of the split."""
    index = json.loads((folder / "dataset.json").read_bytes())
    sides: dict[str, set[str]] = {"training": set(), "validation": set()}
    for clip in index["clips"]:
        sides[clip["split"]].add(clip["take"])
    return sides


@pytest.fixture(scope="session")
def captures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of made clips, one of them twice as if it were two recordings."""
    folder = tmp_path_factory.mktemp("captures")
    for index, clip in zip(range(6), clips(seed=3, minutes=4.0), strict=False):
        write_motion(folder / f"{chr(97 + index)}_{clip.name}.bvh", clip.clip)
    (folder / "LICENSE.txt").write_text("Free for everybody.\n")
    return folder


# -- made clips: they are always there ---------------------------------------------------------


def test_builds_what_it_says(captures: Path, tmp_path: Path) -> None:
    said = build(captures, "-o", tmp_path / "data")
    assert "shards written, 0 kept" in said
    assert sum(len(shard) for shard in numbers(tmp_path / "data")) > 1000
    told = info(tmp_path / "data")
    assert told["layout"] == "ambulo" and told["licence"] == "LICENSE.txt: Free for everybody."
    assert told["ground_gap_m"] <= 0.01 and told["agreement"] is None
    sides = takes(tmp_path / "data")
    assert sides["training"] and not sides["training"] & sides["validation"]
    again = json.loads(build("-o", tmp_path / "data", "--json"))
    assert again["written"] == 0 and again["kept"] == len(told["clips"])
    text = ambulo("dataset", "info", tmp_path / "data", "--clips")
    assert "steps repeat a foot" in text and "gap cm" in text


def test_dry_run_writes_nothing(captures: Path, tmp_path: Path) -> None:
    said = build(captures, "-o", tmp_path / "data", "--dry-run")
    assert "[[clip]]" in said and "[roles]" in said
    assert not (tmp_path / "data").exists()
    assert json.loads(_core.dataset_check(said))["layout"] == "ambulo"


def test_manifests_are_edited_and_kept(captures: Path, tmp_path: Path) -> None:
    config = tmp_path / "settings.toml"
    config.write_text('mirror = false\nlayout = "holden"\n')
    first = next(captures.glob("a_*.bvh"))
    build(first, "-o", tmp_path / "data", "--config", config, "--licence", "mine")
    assert info(tmp_path / "data")["layout"] == "holden"
    manifest = tmp_path / "data" / "manifest.toml"
    manifest.write_text(manifest.read_text().replace("mirror = false", "mirror = true"))
    again = json.loads(build("-o", tmp_path / "data", "--json"))
    assert (again["written"], again["kept"]) == (1, 1)
    assert "edit it, or --overwrite" in build("-o", tmp_path / "data", "--licence", "x", code=2)
    assert "5 files are not in" in build(captures, "-o", tmp_path / "data")
    build(captures, "-o", tmp_path / "data", "--overwrite", "--licence", "ours")
    assert info(tmp_path / "data")["licence"] == "ours"
    assert len(info(tmp_path / "data")["clips"]) > 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mirror = true\nlayuot = 'ambulo'\n", "line 2"),
        ("mirror = ", "line 1"),
        ("layout = 'mann'", "expected ambulo or holden"),
        ("[gaits]\nwalk = -1.0", "gaits.walk"),
        ("licence = 'a'\nlicence = 'b'", "duplicate key"),
    ],
)
def test_broken_settings_are_placed(captures: Path, tmp_path: Path, text: str, said: str) -> None:
    config = tmp_path / "settings.toml"
    config.write_text(text)
    output = build(captures, "-o", tmp_path / "data", "--config", config, code=1)
    assert str(config) in output and said in output
    assert not (tmp_path / "data").exists()


def test_says_what_is_missing(captures: Path, tmp_path: Path) -> None:
    assert "name motion files or folders" in build("-o", tmp_path / "data", code=2)
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "no .bvh, .amc or .keys file" in build(empty, "-o", tmp_path / "data", code=2)
    assert "has no dataset.json" in ambulo("dataset", "info", empty, code=1)
    (empty / "broken.bvh").write_text("HIERARCHY\nROOT a\n{\n")
    output = build(empty, "-o", tmp_path / "data", code=1)
    assert "broken.bvh" in output and "line" in output
    # One good file among them is enough; what is left out is named.
    good = next(captures.glob("a_*.bvh"))
    output = build(empty, good, "-o", tmp_path / "data")
    assert "left out" in output and "broken.bvh" in output
    labels = tmp_path / "data" / "labels" / f"{good.stem}.txt"
    labels.write_text("skip 1 2\nstep up 3\n")
    output = build("-o", tmp_path / "data", code=1)
    assert f"{labels.name}: line 2: expected" in output


def test_own_labels_count(captures: Path, tmp_path: Path) -> None:
    good = next(captures.glob("b_*.bvh"))
    build(good, "-o", tmp_path / "data")
    rows = info(tmp_path / "data")["rows"]["training"]
    automatic = (tmp_path / "data" / "labels" / f"{good.stem}.auto.txt").read_text()
    assert "step right" in automatic and "% sure" in automatic
    (tmp_path / "data" / "labels" / f"{good.stem}.txt").write_text("skip 2 3\ngait crouch 3 4.5\n")
    build("-o", tmp_path / "data")
    told = info(tmp_path / "data")
    assert told["rows"]["training"] == rows - 2 * 60
    assert told["categories"]["crouch"] == 2 * 90


def peak_of(*arguments: object) -> int:
    """Most resident memory of a build in a process of its own, bytes."""
    code = (
        "import resource, sys; from ambulo.cli import cli\n"
        "cli(sys.argv[1:], standalone_mode=False)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    command = [sys.executable, "-c", code, "dataset", "build", *map(str, arguments)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    # Linux counts in KiB, macOS in bytes.
    return int(told.split()[-1]) * (1 if sys.platform == "darwin" else 1024)


@pytest.mark.skipif(not hasattr(resource, "getrusage"), reason="this system tells no peak memory")
def test_memory_does_not_grow_with_the_number_of_clips(captures: Path, tmp_path: Path) -> None:
    source = min(captures.glob("*.bvh"), key=lambda path: path.stat().st_size)
    config = tmp_path / "settings.toml"
    config.write_text("mirror = false\n[terrain]\nsource = 'flat'\n")
    peaks = []
    for count in (40, 160):
        folder = tmp_path / f"of {count}"
        folder.mkdir()
        for index in range(count):
            (folder / f"take{index}.bvh").symlink_to(source)
        output = tmp_path / f"data {count}"
        peaks.append(peak_of(folder, "-o", output, "--config", config, "--threads", 2))
        rows = sum(path.stat().st_size for path in (output / "shards").glob("*.npy"))
    assert rows > 60e6, "too small to tell"
    assert peaks[1] - peaks[0] < 20e6, f"{peaks} bytes for 40 and 160 clips"


# -- real recordings ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def holden(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of the three published clips."""
    output = tmp_path_factory.mktemp("holden") / "data"
    build(*(data / "holden-pfnn" / f"{name}.bvh" for name in HOLDEN), "-o", output)
    return output


def test_automatic_labels_agree_with_those_made_by_hand(holden: Path) -> None:
    agreement = info(holden)["agreement"]
    assert agreement["phase_error"] <= 0.05
    assert abs(agreement["phase_shift"]) <= 0.02
    assert agreement["gait_agreement"] >= 0.90
    assert "cycles off in the mean" in ambulo("dataset", "info", holden)


def test_the_published_layout_builds(data: Path, tmp_path: Path) -> None:
    config = tmp_path / "settings.toml"
    height_map = json.dumps(str(data / "holden-pfnn" / "hmap_001_smooth.txt"))
    config.write_text(
        f'layout = "holden"\n[terrain]\nsource = "files"\nfiles = [{height_map}]\ncopies = 2\n'
    )
    files = [data / "holden-pfnn" / f"{name}.bvh" for name in HOLDEN]
    build(*files, "-o", tmp_path / "data", "--config", config)
    shards = numbers(tmp_path / "data")
    assert {shard.shape[1] for shard in shards} == {6 + 342 + 311}
    told = info(tmp_path / "data")
    assert 0.0 < told["ground_gap_m"] <= 0.01
    index = json.loads((tmp_path / "data" / "dataset.json").read_bytes())
    np.testing.assert_allclose(index["parts"]["feet"]["heights"], [0.05, 0.04] * 2)
    # Mirror images: in the mean nobody turns, and hips look ahead.
    rotations = np.concatenate([shard[:, -93:-90] for shard in shards])
    assert np.abs(rotations).max() < 0.6, "hips are turned round in some clip"
    # The same units and signs as theirs: forward speed and phase change a frame.
    published = np.fromfile(data / "holden-pfnn" / "network" / "Ymean.bin", np.float32)
    ours = np.array(index["statistics"]["output_mean"])
    np.testing.assert_allclose(ours[[1, 3]], published[[1, 3]], rtol=0.2)


def test_lafan1_builds(data: Path, tmp_path: Path) -> None:
    build(data / "lafan1", "-o", tmp_path / "data")
    told = info(tmp_path / "data")
    assert told["joints"] == 22 and sum(told["rows"].values()) > 150_000
    assert told["repeated_steps"] < 0.05 and told["ground_gap_m"] <= 0.01
    assert 0.05 < told["rows"]["validation"] / sum(told["rows"].values()) < 0.15
    sides = takes(tmp_path / "data")
    assert len(sides["validation"]) > 3 and not sides["training"] & sides["validation"]


@pytest.mark.parametrize(("folder", "joints"), [("cmu", 31), ("bandai", 21)])
def test_other_recordings_build(data: Path, tmp_path: Path, folder: str, joints: int) -> None:
    build(data / folder, "-o", tmp_path / "data")
    told = info(tmp_path / "data")
    assert told["joints"] == joints and told["rows"]["training"] > 5000
    assert told["contact_confidence"] > 0.9
    numbers(tmp_path / "data")


def test_dogs_are_refused_until_their_axes_are_named(data: Path, tmp_path: Path) -> None:
    said = build(data / "mann-dog", "-o", tmp_path / "data", code=1)
    assert "four-footed" in said and 'axes = "ambulo"' in said
    assert not (tmp_path / "data").exists()
    config = tmp_path / "dog.toml"
    config.write_text('axes = "ambulo"\n')
    build(data / "mann-dog", "-o", tmp_path / "data", "--config", config)
    assert info(tmp_path / "data")["rows"]["training"] > 500
    numbers(tmp_path / "data")


# -- stopping ----------------------------------------------------------------------------------


def wait_for_shards(process: subprocess.Popen[str], folder: Path, count: int) -> None:
    """Returns as soon as some shards are done."""
    end = time.monotonic() + 30.0
    while process.poll() is None and time.monotonic() < end:
        if len(list((folder / "shards").glob("*.json"))) >= count:
            return
        time.sleep(0.002)


@pytest.fixture(scope="module")
def sources(data: Path) -> Sequence[Path]:
    return sorted((data / "lafan1").glob("obstacles*.bvh"))


@pytest.fixture(scope="module")
def whole(sources: Sequence[Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What a build writes that nobody stops."""
    output = tmp_path_factory.mktemp("whole") / "data"
    build(*sources, "-o", output)
    return written(output)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=lambda number: number.name)
def test_a_stopped_build_goes_on(
    sources: Sequence[Path],
    whole: dict[str, bytes],
    tmp_path: Path,
    number: signal.Signals,
) -> None:
    output = tmp_path / "data"
    process = started(*sources, "-o", output, "--threads", 2)
    wait_for_shards(process, output, 9)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60.0)
    if number == signal.SIGINT:
        assert process.returncode == 130 and errors.strip() == "stopped"
    assert not (output / "dataset.json").exists(), "it was done before it could be stopped"
    report = json.loads(build("-o", output, "--json"))
    assert report["kept"] >= 8 and report["written"] > 0
    # Folders of the same depth: paths in the manifest are the same, too.
    now = written(output)
    assert sorted(name for name in whole | now if whole.get(name) != now.get(name)) == []
