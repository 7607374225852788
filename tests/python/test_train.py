"""Training: settings, runs that are cut short, several processes, the command."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import load_model
from ambulo.checkpoint import Run, RunError
from ambulo.cli.train import train as command
from ambulo.data import Dataset, open_dataset, windows
from ambulo.export import ExportError
from ambulo.presets import (
    PRESETS,
    Settings,
    SettingsError,
    Stage,
    difference,
    load_settings,
    plain,
    settings,
)
from ambulo.train import Progress, TrainingError, train
from ambulo.trainer import Trainer, loss_weights, runtime_feedback, stage_at, total_steps, wiring
from synthetic_dataset import SMALL, spoiled, write_dataset


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data") / "toy", slope=0.1)


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return open_dataset(folder)


def curve(run: Path) -> list[dict[str, Any]]:
    """The metrics without what a clock decides."""
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    return [
        {k: v for k, v in line.items() if "second" not in k and "_s" not in k} for line in lines
    ]


# -- settings ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_preset_is_sound(name: str, dataset: Dataset) -> None:
    made = load_settings(name)
    assert settings(json.loads(json.dumps(plain(made)))) == made
    assert total_steps(made, dataset) > 0
    loss_weights(dataset, made)


def test_the_published_presets_are_as_published() -> None:
    made = load_settings("holden")
    assert made.hidden == (512, 512) and made.batch == 32 and made.init == "published"
    assert made.learning_rate == 1e-4 and made.schedule == "constant" and made.warmup == 0
    assert made.dropout_input == made.dropout_hidden == 0.3
    assert made.l1 == pytest.approx(0.01 / 6) and made.weight_decay == made.clip == made.ema == 0
    assert made.joint_weight == 0.1 and len(made.masked_joints) == 12 and not made.hide_constant
    assert made.stages == (Stage(),) and made.noise == made.balance == made.implied == 0
    assert made.epochs == 20 and load_settings("holden-xt").epochs == 40
    assert load_settings("holden-xl").hidden == (512, 512, 512)
    ava = load_settings("ava")
    assert ava.hidden == (512, 512) and ava.masked_joints == ()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("learning_rat = 0.1", "'learning_rat' is not a setting; did you mean 'learning_rate'?"),
        ("xyzzy = 1", "'xyzzy' is not a setting; known: "),
        ("learning_rate = 0", "learning_rate: 0.0 is not between 1e-09 and 1"),
        ("learning_rate = nan", "learning_rate: nan is not between"),
        ("batch = 1.5", "batch: expected a whole number, got 1.5"),
        ("batch = true", "batch: expected a whole number, got True"),
        ("own_phase = 1", "own_phase: expected true or false, got 1"),
        ("hidden = [512, 0]", "hidden: expected widths from 1 to 8192"),
        ("hidden = 512", "hidden: expected a list of widths, got 512"),
        ("init = 'zero'", "init: 'zero' is none of glorot, published"),
        ("steps = 0\nepochs = 0", "steps and epochs are both 0"),
        ("stages = []", "stages: expected tables"),
        ("[[stages]]\nshare = 0.5", "stages: their shares sum to 0.5, expected 1"),
        ("[[stages]]\nframe = 2", "'frame' is not a setting; did you mean 'frames'?"),
        ("[[stages]]\nframes = 0", "frames: 0 is not between 1 and 600"),
        ("[block_weights]\ncontacts = -1", "block_weights: expected numbers from 0"),
        ("final_rate = 0.5", "final_rate 0.5 is above learning_rate"),
        ("steps = = 1", "Invalid value"),
    ],
)
def test_a_config_that_makes_no_sense_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "config.toml"
    path.write_text(text)
    with pytest.raises(SettingsError, match=re.escape(says)) as caught:
        load_settings("default", path)
    assert "config.toml" in str(caught.value)


def test_a_config_goes_over_the_preset_and_the_command_line_over_both(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text("steps = 7\nseed = 3\nlearning_rate = 1\n[tuning]\npose_halflife = 0\n")
    made = load_settings("quick", path, steps=9, seed=None)
    assert (made.steps, made.seed, made.learning_rate) == (9, 3, 1.0)
    assert made.tuning == {"pose_halflife": 0}
    assert runtime_feedback(made, 60.0) == 1.0
    assert runtime_feedback(load_settings("holden"), 60.0) == 0.5
    with pytest.raises(SettingsError, match="did you mean 'holden'"):
        load_settings("holdn")


def test_differences_are_named() -> None:
    a, b = plain(settings(SMALL)), plain(settings({**SMALL, "batch": 64}))
    assert difference(a, b) == ["batch (32 → 64)"] and difference(a, a) == []


def test_stages_follow_each_other_and_ages_grow() -> None:
    made = settings(SMALL)
    ages = [stage_at(made, step, 24)[1] for step in range(24)]
    assert ages[0] == 1 and 6 <= ages[11] <= 8 and ages[:12] == sorted(ages[:12])
    assert ages[12:] == [12] * 12
    assert [stage_at(made, step, 24)[0].frames for step in (0, 11, 12, 23, 24)] == [1, 1, 3, 3, 3]


def test_weights_of_the_loss(dataset: Dataset) -> None:
    made = settings({**SMALL, "weigh": "blocks", "block_weights": {"contacts": 2.0}})
    weights = loss_weights(dataset, made)
    blocks = dataset.blocks["outputs"]
    assert weights.mean() == pytest.approx(1.0, rel=1e-5)
    sums = {name: float(weights[block].sum()) for name, block in blocks.items()}
    assert sums["contacts"] == pytest.approx(2 * sums["joint_position"], rel=1e-5)
    assert sums["root_yaw"] == pytest.approx(sums["joint_position"], rel=1e-5)
    with pytest.raises(SettingsError, match="'contact' is no output block; there are root_vel"):
        loss_weights(dataset, settings({**SMALL, "block_weights": {"contact": 1.0}}))


# -- runs -------------------------------------------------------------------------------------


def test_it_learns_and_the_same_seed_learns_the_same(dataset: Dataset, tmp_path: Path) -> None:
    made = settings({**SMALL, "hidden": [32], "steps": 300, "every": 50, "dropout_input": 0.0})
    lines: list[dict[str, Any]] = []

    def watch(progress: Progress) -> None:
        if progress.line:
            lines.append(progress.line)

    result = train(dataset, made, Run(tmp_path / "a"), watch=watch)
    assert result.finished and result.step == 300 and not result.warnings
    assert [line["step"] for line in lines] == [50, 100, 150, 200, 250, 300]
    # Better than repeating the last pose, which is what an untrained loop amounts to.
    rows = windows(dataset, "validation", 10, 8)
    w = wiring(dataset)
    told = rows[..., slice(*w.x)][..., slice(*w.position_in)]
    asked = rows[..., slice(*w.y)][..., slice(*w.position_out)]
    repeat = 100 * np.linalg.norm((told - asked).reshape(8, 10, -1, 3), axis=-1).mean()
    assert lines[-1]["loop_cm"] < 0.7 * lines[0]["loop_cm"]
    assert lines[-1]["one_step"] < 0.4 * lines[0]["one_step"]
    assert lines[-1]["loop_cm"] < 2.0 * repeat
    for name in ("last.npz", "best.npz", "curve.png", "settings.json", "metrics.jsonl"):
        assert (tmp_path / "a" / name).stat().st_size > 0
    again = train(dataset, made, Run(tmp_path / "b"))
    assert curve(tmp_path / "a") == curve(tmp_path / "b")
    for one, two in zip(result.params, again.params, strict=True):
        assert np.array_equal(one["weight"], two["weight"])
    other = train(dataset, replace(made, seed=1, steps=50), Run(tmp_path / "c"))
    assert curve(tmp_path / "c")[0]["loss"] != lines[0]["loss"]
    assert other.best_step == 50


def test_early_stop_and_a_set_without_validation(tmp_path: Path) -> None:
    dataset = open_dataset(write_dataset(tmp_path / "d", clips=1, validation=0))
    made = settings({**SMALL, "patience": 2, "final_rate": 0.0, "learning_rate": 1e-9, "ema": 0.0})
    result = train(dataset, made, Run(tmp_path / "run"))
    assert result.finished and result.step == 18 and result.best_step <= 6
    assert "judged on training clips" in result.warnings[0]
    assert "training_loop_cm" in result.measures


def test_a_loss_that_is_no_number_stops_the_run(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learn = Trainer.learn
    monkeypatch.setattr(
        Trainer, "learn", lambda *a: {**learn(*a), "loss": jnp.float32(float("nan"))}
    )
    with pytest.raises(TrainingError, match="lower learning_rate"):
        train(dataset, settings(SMALL), Run(tmp_path / "run"))


@pytest.fixture(scope="session", autouse=True)
def compiled_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """What one run compiled the next one takes, and in a hurry: most of the time goes there."""
    CACHE["JAX_COMPILATION_CACHE_DIR"] = str(tmp_path_factory.mktemp("compiled"))
    jax.config.update("jax_compilation_cache_dir", CACHE["JAX_COMPILATION_CACHE_DIR"])
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_disable_most_optimizations", True)


CACHE = {
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    "JAX_DISABLE_MOST_OPTIMIZATIONS": "1",
}


def environment() -> dict[str, str]:
    """One processor each: what is compared is not to depend on how work is shared."""
    own = {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false", "JAX_PLATFORMS": "cpu"}
    return {**os.environ, **own, **CACHE}


CALL = "from ambulo.cli import main; main()"


def call(*arguments: object) -> list[str]:
    return [sys.executable, "-c", CALL, "train", *map(str, arguments)]


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "config.toml"
    stages = "".join(
        f"[[stages]]\n{''.join(f'{key} = {value}' + chr(10) for key, value in stage.items())}"
        for stage in SMALL["stages"]
    )
    keys = {
        key: value
        for key, value in SMALL.items()
        if not isinstance(value, list | dict | str | bool)
    }
    lines = "".join(f"{key} = {value}\n" for key, value in keys.items())
    path.write_text(f"{lines}hidden = [16]\n{stages}")
    return path


def test_a_killed_run_goes_on_to_the_same_curve(folder: Path, tmp_path: Path, config: Path) -> None:
    """Killed hard, in the middle of a step after its second checkpoint."""
    whole, cut = tmp_path / "whole.safetensors", tmp_path / "cut.safetensors"
    subprocess.run(
        call(folder, "-o", whole, "--config", config), env=environment(), check=True,
        capture_output=True,
    )  # fmt: skip
    # The same run, but so slow after its second report that it can be killed for certain.
    slow = (
        "import time, ambulo.train as t\n"
        "turn = t._Loop.turn\n"
        "t._Loop.turn = lambda self: (time.sleep(0.3 if self.step >= 13 else 0), turn(self))[1]\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", slow + CALL, *call(folder, "-o", cut, "--config", config)[3:]],
        env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    metrics = tmp_path / "cut.run" / "metrics.jsonl"
    for _ in range(600):
        if metrics.is_file() and metrics.read_text().count("\n") >= 2:
            break
        assert process.poll() is None, "it ended before it could be killed"
        time.sleep(0.1)
    time.sleep(0.5)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not cut.exists()
    # A crash may also come between a report and its checkpoint.
    with metrics.open("a") as file:
        file.write('{"step": 18, "loss": 1.0}\n{"step": 2')
    subprocess.run(
        call(folder, "-o", cut, "--config", config, "--resume"), env=environment(), check=True,
        capture_output=True,
    )  # fmt: skip
    assert len(curve(tmp_path / "whole.run")) == 4
    assert curve(tmp_path / "cut.run") == curve(tmp_path / "whole.run")
    assert whole.read_bytes() == cut.read_bytes()


def test_ctrl_c_saves_and_says_how_to_go_on(folder: Path, tmp_path: Path, config: Path) -> None:
    output = tmp_path / "m.safetensors"
    process = subprocess.Popen(
        call(folder, "-o", output, "--config", config, "--steps", 100000), env=environment(),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    for _ in range(600):
        if (tmp_path / "m.run" / "last.npz").is_file():
            break
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "--resume goes on from there" in told and "Traceback" not in told
    found = Run(tmp_path / "m.run").load("last")
    assert found is not None
    step = int(found[0]["['step']"])
    assert step >= 6 and f"stopped at step {step}" in told
    assert not output.exists()


def test_a_run_goes_on_only_with_what_it_was_begun_with(
    dataset: Dataset, folder: Path, tmp_path: Path
) -> None:
    made = settings(SMALL)
    run = Run(tmp_path / "run")
    train(dataset, made, run)
    with pytest.raises(RunError, match=r"other settings: learning_rate \(0.003 → 0.001\)"):
        train(dataset, replace(made, learning_rate=1e-3), run, resume=True)
    other = open_dataset(spoiled(folder, tmp_path, lambda m, _: m.update(licence="mine")))
    with pytest.raises(RunError, match="another data set"):
        train(other, made, run, resume=True)
    path = run.folder / "last.npz"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(RunError, match="not a checkpoint"):
        train(dataset, made, run, resume=True)
    # Begun, but killed before its first checkpoint: it starts.
    path.unlink()
    assert train(dataset, made, run, resume=True).step == 24


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_two_processes_learn_what_one_does(folder: Path, tmp_path: Path, config: Path) -> None:
    one, two = tmp_path / "one.safetensors", tmp_path / "two.safetensors"
    subprocess.run(
        call(folder, "-o", one, "--config", config), env=environment(), check=True,
        capture_output=True,
    )  # fmt: skip
    where = f"127.0.0.1:{free_port()}"
    several = ["--distributed", where, "--processes", 2, "--process"]
    processes = [
        subprocess.Popen(
            call(folder, "-o", two, "--config", config, *several, index),
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for index in range(2)
    ]
    for process in processes:
        _, told = process.communicate(timeout=120)
        assert process.returncode == 0, told
    a, b = curve(tmp_path / "one.run"), curve(tmp_path / "two.run")
    assert len(a) == len(b) == 4
    for line, other in zip(a, b, strict=True):
        assert line.keys() == other.keys()
        assert all(line[key] == pytest.approx(other[key], rel=2e-3) for key in line)
    phase, x = np.zeros(3, np.float32), np.zeros((3, load_model(one).inputs), np.float32)
    ours, theirs = load_model(one).predict(x, phase), load_model(two).predict(x, phase)
    assert np.allclose(ours, theirs, rtol=1e-2, atol=1e-3)


# -- the command line -------------------------------------------------------------------------


@pytest.fixture
def invoke(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    yield lambda *arguments: CliRunner().invoke(command, [str(a) for a in arguments])


def test_the_command_trains_and_reports(
    invoke: Any, folder: Path, tmp_path: Path, config: Path
) -> None:
    output = tmp_path / "m.safetensors"
    plan = invoke(folder, "-o", output, "--config", config, "--dry-run", "--json")
    assert plan.exit_code == 0 and list(tmp_path.iterdir()) == [config]
    planned = json.loads(plan.stdout)
    assert planned["steps"] == 24 and planned["rows"] == {"training": 1200, "validation": 400}
    done = invoke(folder, "-o", output, "--config", config, "--json")
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["steps"] == 24 and report["parity"] <= 1e-5
    assert done.stderr.count("step ") >= 4 and "samples/s" in done.stderr
    model = load_model(output)
    assert model.header["provenance"]["seed"] == "0"
    refused = invoke(folder, "-o", output, "--config", config)
    assert refused.exit_code == 1 and "--overwrite replaces it" in refused.output
    output.unlink()
    refused = invoke(folder, "-o", output, "--config", config)
    assert "m.run holds a run; --resume goes on" in refused.output
    again = invoke(folder, "-o", output, "--config", config, "--resume")
    assert again.exit_code == 0 and output.is_file()


def test_what_could_not_be_written_is_refused_before_training(
    invoke: Any, folder: Path, tmp_path: Path
) -> None:
    path = tmp_path / "config.toml"
    path.write_text("[tuning]\npose_halflif = 1.0\n")
    run = invoke(folder, "-o", tmp_path / "m.safetensors", "--config", path)
    assert isinstance(run.exception, ExportError) and "pose_halflif" in str(run.exception)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--processes", 2], "belong to --distributed"),
        (["--distributed", "h:1"], "needs --processes and --process"),
        (["--distributed", "h:1", "--processes", 2, "--process", 2], "is not below"),
        (["--resume", "--overwrite"], "give one of them"),
        (["--preset", "quik"], "Invalid value for '--preset'"),
    ],
)
def test_wrong_usage_is_named(
    invoke: Any, folder: Path, tmp_path: Path, arguments: list[object], says: str
) -> None:
    run = invoke(folder, "-o", tmp_path / "m.safetensors", *arguments)
    assert run.exit_code == 2 and says in run.output
    assert not list(tmp_path.iterdir())


def test_without_jax_it_says_how_to_get_it(
    invoke: Any, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    run = invoke(folder, "-o", tmp_path / "m.safetensors")
    assert run.exit_code == 1 and "pip install 'ambulo[train]'" in run.output


def test_help_needs_no_jax() -> None:
    told = (
        "import sys; import ambulo.cli.train; print(any(m.startswith('jax') for m in sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_tensorboard_gets_the_curve(
    invoke: Any, folder: Path, tmp_path: Path, config: Path
) -> None:
    pytest.importorskip("tensorboardX")
    logs = tmp_path / "logs"
    run = invoke(
        folder, "-o", tmp_path / "m.safetensors", "--config", config, "--tensorboard", logs
    )
    assert run.exit_code == 0
    (file,) = logs.iterdir()
    content = file.read_bytes()
    assert content.count(b"loop_cm") == 4 and b"loss" in content


def test_defaults_of_settings_are_within_their_ranges() -> None:
    assert settings({**plain(Settings()), "steps": 1}).steps == 1
