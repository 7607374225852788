"""The starter motion: mechanics, labels, repeatability, and the command that writes it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from ambulo import read_motion
from ambulo.cli.starter import starter
from ambulo.starter_motion import GAITS, Level, StarterClip, Wish, clips, perform, plan
from ambulo.starter_motion.body import NAMES, OFFSETS, PARENTS, TO_HEEL, TO_TIP, TO_TOE, joint
from ambulo.starter_motion.rotations import log, product, rotated

Floats = NDArray[np.float64]
MOTION = plan()
# Joints of the sources below, at 0.1 mm: changes with every change of the motion, and only then.
GOLDEN = "69dfc709b061336a"


@pytest.fixture(scope="module")
def made() -> dict[str, StarterClip]:
    return {clip.name: clip for clip in clips(seed=0)}


@pytest.fixture(scope="module", params=[entry.name for entry in MOTION])
def clip(made: dict[str, StarterClip], request: pytest.FixtureRequest) -> StarterClip:
    return made[request.param]


def globals_of(clip: StarterClip) -> tuple[Floats, Floats]:
    """Places (F, 22, 3) and rotations (F, 22, 4) in the world, in double precision."""
    local, root = clip.clip.rotations, clip.clip.translations[:, 0]
    places, turned = np.zeros((*local.shape[:2], 3)), np.zeros(local.shape)
    for index, parent in enumerate(PARENTS):
        if parent < 0:
            places[:, index], turned[:, index] = root, local[:, index]
            continue
        places[:, index] = places[:, parent] + rotated(turned[:, parent], OFFSETS[index])
        turned[:, index] = product(turned[:, parent], local[:, index])
    return places, turned


def walked(*wishes: Wish, seed: int = 5) -> StarterClip:
    return perform("test", [Wish(2.0), *wishes, Wish(2.0)], Level(), seed)


def gone(clip: StarterClip, start: float, end: float) -> float:
    """Mean speed of the hips over the ground, m/s."""
    hips = clip.clip.positions()[:, 0][:, [0, 2]]
    way = hips[int(end * 60)] - hips[int(start * 60)]
    return float(np.hypot(*way)) / (end - start)


# -- mechanics ------------------------------------------------------------------------------------


def test_a_planted_foot_stays_where_it_is(clip: StarterClip) -> None:
    places = globals_of(clip)[0]
    for side in (0, 1):
        heel, toe = clip.contacts[:, 2 * side] > 0.5, clip.contacts[:, 2 * side + 1] > 0.5
        both = heel & toe
        for name, planted in (("Toe", toe), ("Foot", both)):
            moved = np.linalg.norm(np.diff(places[:, joint(name, side)], axis=0), axis=1)
            assert moved[planted[1:] & planted[:-1]].max(initial=0.0) < 0.002


def test_no_sole_is_below_the_ground(clip: StarterClip) -> None:
    places, turned = globals_of(clip)
    for side in (0, 1):
        foot, toes = joint("Foot", side), joint("Toe", side)
        points = [
            places[:, foot] + rotated(turned[:, foot], TO_HEEL),
            places[:, foot] + rotated(turned[:, foot], TO_TOE * [1, 0, 1] + [0, TO_HEEL[1], 0]),
            places[:, toes] + rotated(turned[:, toes], TO_TIP),
        ]
        # A swinging foot may brush a slope; the edge of a step is no place for a foot either.
        deepest = -0.005 if isinstance(clip.ground, Level) else -0.02
        for point in points:
            above = point[:, 1] - clip.ground.height(point[:, 0], point[:, 2])
            assert above.min() > deepest


def test_knees_bend_forwards_and_never_snap_straight(clip: StarterClip) -> None:
    for side in (0, 1):
        bend = log(clip.clip.rotations[:, joint("Leg", side)])
        assert np.degrees(bend[:, 0].min()) > 5.0
        assert np.degrees(bend[:, 0].max()) < 150.0
        assert np.degrees(abs(bend[:, 1:]).max()) < 0.1, "a knee is a hinge"


def test_nothing_jumps_from_frame_to_frame(clip: StarterClip) -> None:
    places = globals_of(clip)[0]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=-1) * 60.0
    force = np.linalg.norm(np.diff(places, 2, axis=0), axis=-1) * 3600.0
    assert speed.max() < 16.0
    # The joints of captured jogging reach some 130 m/s2.
    assert force.max() < 400.0
    assert np.percentile(force, 99) < 110.0
    spin = np.linalg.norm(
        log(product(clip.clip.rotations[:-1] * [-1, -1, -1, 1], clip.clip.rotations[1:])), axis=-1
    )
    assert spin.max() * 60.0 < 40.0


def test_the_person_is_grown_up_and_stays_upright(clip: StarterClip) -> None:
    assert clip.clip.names == list(NAMES)
    np.testing.assert_allclose(clip.clip.offsets, OFFSETS)
    places = globals_of(clip)[0]
    hips = places[:, 0]
    height = hips[:, 1] - np.minimum(places[:, joint("Foot", 0), 1], places[:, joint("Foot", 1), 1])
    assert height.min() > 0.4
    assert height.max() < 1.05
    assert (places[:, joint("Head"), 1] - hips[:, 1]).min() > 0.45


@pytest.mark.parametrize("name", ["strafe_left_00", "strafe_right_00", "walk_00", "jog_00"])
def test_feet_never_cross(made: dict[str, StarterClip], name: str) -> None:
    places = globals_of(made[name])[0]
    across = places[:, joint("UpLeg", 0)] - places[:, joint("UpLeg", 1)]
    across[:, 1] = 0.0
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    apart = places[:, joint("Foot", 0)] - places[:, joint("Foot", 1)]
    assert (apart * across).sum(axis=1).min() > 0.03


# -- gaits ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gait", "speed", "side"),
    [
        ("walk", 0.5, 0.0), ("walk", 1.4, 0.0), ("walk", 2.0, 0.0), ("jog", 2.6, 0.0),
        ("run", 4.5, 0.0), ("walk", 0.9, np.pi), ("walk", 0.8, np.pi / 2), ("crouch", 0.8, 0.0),
    ],
)  # fmt: skip
def test_speed_is_what_was_asked(gait: str, speed: float, side: float) -> None:
    clip = walked(Wish(8.0, gait, speed, side=side))
    assert gone(clip, 2.5, 6.5) == pytest.approx(speed, rel=0.03)


@pytest.mark.parametrize(
    ("gait", "speed", "steps", "down"),
    [
        ("walk", 0.6, (1.0, 1.5), (0.64, 0.74)),
        ("walk", 1.4, (1.7, 2.05), (0.58, 0.67)),
        ("jog", 2.6, (2.5, 2.9), (0.33, 0.45)),
        ("run", 4.5, (2.7, 3.2), (0.22, 0.36)),
    ],
)
def test_rhythm_follows_the_literature(
    gait: str, speed: float, steps: tuple[float, float], down: tuple[float, float]
) -> None:
    clip = walked(Wish(12.0, gait, speed))
    onsets = np.sort(np.concatenate(clip.onsets))
    steady = onsets[(onsets > 2.0) & (onsets < 11.0)]
    assert steps[0] < 1.0 / np.diff(steady).mean() < steps[1]
    on = globals_of_stance(clip)[120:660]
    assert down[0] < on.mean() < down[1]
    walks = gait == "walk"
    assert bool((on.sum(axis=1) == 0).any()) != walks, "a run has a flight, a walk has none"
    assert bool((on.sum(axis=1) == 2).any()) == walks, "a walk has both feet down, a run never"


def globals_of_stance(clip: StarterClip) -> Floats:
    """(F, 2) whether the left and the right foot are down, from the sole's lowest point."""
    places, turned = globals_of(clip)
    down = []
    for side in (0, 1):
        foot, toes = joint("Foot", side), joint("Toe", side)
        heel = places[:, foot] + rotated(turned[:, foot], TO_HEEL)
        tip = places[:, toes] + rotated(turned[:, toes], TO_TIP)
        down.append(np.minimum(heel[:, 1], tip[:, 1]) < 0.002)
    return np.stack(down, axis=1).astype(float)


def test_arms_swing_with_the_opposite_legs(made: dict[str, StarterClip]) -> None:
    for name in ("walk_00", "jog_00"):
        places = globals_of(made[name])[0]
        ahead = places[:, joint("Foot", 0), 2] - places[:, joint("Foot", 1), 2]
        swung = places[:, joint("Hand", 0), 2] - places[:, joint("Hand", 1), 2]
        assert np.corrcoef(ahead, swung)[0, 1] < -0.8
        assert 0.2 < np.ptp(swung) < 1.4


def test_turns_on_the_spot_stay_there_and_turn_as_far_as_asked() -> None:
    clip = walked(Wish(2.0, "walk", turn=np.pi / 2), Wish(3.0))
    places = globals_of(clip)[0]
    across = places[:, joint("UpLeg", 0)] - places[:, joint("UpLeg", 1)]
    yaw = np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))
    assert yaw[-30:].mean() - yaw[:10].mean() == pytest.approx(np.pi, abs=0.15)
    assert np.hypot(places[:, 0, 0], places[:, 0, 2]).max() < 0.15


def test_a_jump_leaves_the_ground_for_as_long_as_asked() -> None:
    clip = walked(Wish(2.4, "stand", jump=0.4), Wish(2.0))
    air = (globals_of_stance(clip).sum(axis=1) == 0).sum() / 60.0
    assert air == pytest.approx(0.4, abs=0.05)
    hips = globals_of(clip)[0][:, 0, 1]
    assert hips.max() - hips[0] == pytest.approx(9.81 * 0.4**2 / 8 + 0.035, abs=0.03)


def test_a_stand_breathes_and_shifts_its_weight(made: dict[str, StarterClip]) -> None:
    places = globals_of(made["stand_00"])[0]
    hips, shoulder = places[:, 0], places[:, joint("Arm", 0)]
    assert 0.01 < np.ptp(hips[:, 0]) < 0.15
    chest = shoulder[:, 1] - hips[:, 1]
    waves = abs(np.fft.rfft(chest - chest.mean()))
    hertz = np.fft.rfftfreq(len(chest), 1 / 60)
    breath = waves[(hertz > 0.2) & (hertz < 0.3)].max()
    assert breath > 3.0 * np.median(waves[(hertz > 0.4) & (hertz < 2.0)])


# -- labels ---------------------------------------------------------------------------------------


def test_spans_of_gaits_tile_the_clip(clip: StarterClip) -> None:
    starts, ends, names = zip(*clip.gaits, strict=True)
    assert starts[0] == 0.0
    assert ends[-1] == pytest.approx(clip.clip.frames / 60.0)
    assert starts[1:] == ends[:-1]
    assert set(names) <= set(GAITS)


def test_feet_come_down_at_the_onsets(clip: StarterClip) -> None:
    for side in (0, 1):
        on = clip.contacts[:, 2 * side : 2 * side + 2].max(axis=1)
        for onset in clip.onsets[side]:
            frame = int(np.ceil(onset * 60.0 - 1e-6))
            if 2 <= frame < len(on) - 10:
                assert on[frame : frame + 8].max() == 1.0
                assert on[frame - 1] == 0.0


def test_every_gait_is_there_in_good_measure(made: dict[str, StarterClip]) -> None:
    seconds: dict[str, float] = dict.fromkeys(GAITS, 0.0)
    for clip in made.values():
        for start, end, gait in clip.gaits:
            seconds[gait] += end - start
    total = sum(seconds.values())
    assert 12 * 60 < total < 20 * 60
    least = {"stand": 60, "walk": 180, "jog": 90, "run": 60, "crouch": 30, "jump": 8}
    for gait, wanted in (least | {"backward": 30, "sideways": 45}).items():
        assert seconds[gait] > wanted, f"{gait}: {seconds[gait]:.0f} s"


def test_slopes_and_steps_are_really_climbed(made: dict[str, StarterClip]) -> None:
    for kind in ("slope_walk", "steps_walk"):
        climbed = []
        for clip in (made[f"{kind}_00"], made[f"{kind}_01"]):
            places = globals_of(clip)[0]
            planted = clip.contacts[:, 1] > 0.5
            toe = places[planted, joint("Toe", 0)]
            ground = clip.ground.height(toe[:, 0], toe[:, 2])
            climbed.append(np.ptp(ground))
            assert abs(toe[:, 1] - ground - 0.028).max() < 0.02
        # How hilly one clip's ground is, is chance.
        assert min(climbed) > 0.15 and max(climbed) > 0.3


# -- repeatability --------------------------------------------------------------------------------


def hashed(clips_: list[StarterClip]) -> str:
    digest = hashlib.sha256()
    for clip in clips_:
        places = globals_of(clip)[0]
        digest.update(np.rint(places * 1e4).astype("<i4").tobytes())
        digest.update(np.rint(np.concatenate(clip.onsets) * 1e4).astype("<i4").tobytes())
    return digest.hexdigest()[:16]


def first(seed: int, count: int, minutes: float = 1.0) -> list[StarterClip]:
    source = clips(seed, minutes)
    return [next(source) for _ in range(count)]


def test_the_same_seed_makes_the_same_motion() -> None:
    once = hashed(list(clips(3, 1.0)))
    assert once == hashed(list(clips(3, 1.0)))
    assert hashed(first(3, 2)) != hashed(first(4, 2))
    assert once == GOLDEN, "the motion has changed: look at it, then change the hash"


def test_minutes_are_kept_and_nonsense_is_refused() -> None:
    for minutes in (8.0, 16.0, 40.0):
        assert sum(entry.seconds for entry in plan(minutes)) / 60.0 == pytest.approx(minutes, 0.1)
    names = [entry.name for entry in plan(40.0)]
    assert len(set(names)) == len(names)
    for minutes in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="minutes"):
            next(clips(0, minutes))
    with pytest.raises(ValueError, match="seed"):
        next(clips(-1))


# -- command --------------------------------------------------------------------------------------


def run(*arguments: str):
    return CliRunner().invoke(starter, ["motion", *arguments], catch_exceptions=True)


def test_the_command_writes_files_that_are_read_back_alike(tmp_path: Path) -> None:
    result = run("-o", str(tmp_path), "--minutes", "1", "--seed", "2", "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert [Path(entry["output"]).stem for entry in told] == [e.name for e in plan(1.0)]
    original = first(2, 3)[2]
    clip, report = read_motion(tmp_path / f"{original.name}.bvh")
    assert report["detected"]["axes"] == "cm"
    assert clip.fps == pytest.approx(60.0, abs=1e-3)
    np.testing.assert_allclose(clip.positions(), original.clip.positions() * 100.0, atol=0.01)


def test_what_exists_is_not_written_over(tmp_path: Path) -> None:
    old = tmp_path / "stand_00.bvh"
    old.write_text("mine")
    refused = run("-o", str(tmp_path), "--minutes", "1")
    assert refused.exit_code == 1
    assert "--overwrite" in str(refused.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["stand_00.bvh"]
    assert old.read_text() == "mine"
    assert run("-o", str(tmp_path), "--minutes", "1", "--overwrite").exit_code == 0
    assert old.read_text().startswith("HIERARCHY")


def test_a_dry_run_writes_nothing(tmp_path: Path) -> None:
    result = run("-o", str(tmp_path / "new"), "--minutes", "1", "--dry-run")
    assert result.exit_code == 0, result.output
    assert "would write" in result.output
    assert not (tmp_path / "new").exists()
