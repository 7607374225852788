//! Labels of a walker whose steps and gait are known.

mod common;

use ambulo_dataset::prepare::{LabelFiles, Ready};
use ambulo_dataset::{CATEGORIES, Given, Published};
use common::{
    BACKWARD, CROUCH, FPS, JOG, RUN, STAND, TO_THE_LEFT, WALK, Walker, apart, ready, setup,
};

fn found(walker: &Walker) -> Ready {
    ready(&walker.clip(), false, &LabelFiles::default())
}

fn given(text: &str) -> LabelFiles {
    LabelFiles { given: Some(Given::parse(text).unwrap()), ..LabelFiles::default() }
}

/// Frames far enough from the ends to be judged.
fn inner(ready: &Ready) -> std::ops::Range<usize> {
    60..ready.motion.frames() - 60
}

fn share(ready: &Ready, category: &str) -> f64 {
    let wanted = CATEGORIES.iter().position(|name| *name == category).unwrap();
    let frames = inner(ready);
    let is = |frame: &usize| usize::from(ready.labels.gaits.categories[*frame]) == wanted;
    frames.clone().filter(is).count() as f64 / frames.len() as f64
}

#[test]
fn feet_are_down_when_they_are() {
    for walker in [WALK, JOG, Walker { turn: 0.6, ..WALK }, BACKWARD, TO_THE_LEFT] {
        let found = found(&walker);
        let mut wrong = 0;
        for frame in inner(&found) {
            for side in 0..2 {
                let down = walker.down(side, frame as f64 / FPS);
                wrong += usize::from(found.labels.contacts.foot(frame, side) != down);
            }
        }
        let share = wrong as f64 / (2 * inner(&found).len()) as f64;
        // A foot that has slowed down before it lands counts as landed, some frames early.
        assert!(share < 0.1, "{walker:?}: {:.1} % of the contacts are wrong", 100.0 * share);
        assert!(found.labels.contacts.level);
    }
}

#[test]
fn phase_is_zero_when_the_right_foot_comes_down() {
    for walker in [WALK, JOG, RUN, BACKWARD, Walker { turn: 0.6, ..WALK }] {
        let found = found(&walker);
        for frame in inner(&found) {
            let wanted = walker.cycles(frame as f64 / FPS);
            let got = f64::from(found.labels.phase.at(frame));
            assert!(apart(got, wanted) < 0.05, "{walker:?}: {got} at {wanted} cycles");
            let rate = f64::from(found.labels.phase.rate(frame, FPS as f32));
            assert!((rate / (walker.cadence / 2.0) - 1.0).abs() < 0.1, "{rate} cycles a second");
            assert!(found.labels.usable[frame]);
        }
        assert_eq!(found.labels.repeats, 0.0);
    }
}

#[test]
fn gaits_and_ways_of_moving() {
    let diagonal = Walker { facing: 0.6, ..WALK };
    for (walker, category) in [
        (STAND, "stand"),
        (WALK, "walk"),
        (JOG, "jog"),
        (RUN, "run"),
        (CROUCH, "crouch"),
        (BACKWARD, "backward"),
        (TO_THE_LEFT, "sideways"),
        (diagonal, "walk"),
    ] {
        let found = found(&walker);
        let share = share(&found, category);
        assert!(share > 0.95, "{category} is {:.0} % of {walker:?}", 100.0 * share);
        for shares in &found.labels.gaits.shares {
            assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn a_stand_has_a_phase_that_rests() {
    let found = found(&STAND);
    assert!(inner(&found).all(|frame| found.labels.usable[frame]));
    assert!(inner(&found).all(|frame| found.labels.phase.rate(frame, FPS as f32) == 0.0));
    assert!(found.labels.contacts.soles.iter().all(|soles| *soles == [true; 4]));
}

#[test]
fn a_mirror_swaps_sides() {
    for walker in [WALK, JOG, Walker { turn: 0.5, heading: 1.4, ..WALK }, BACKWARD] {
        let clip = walker.clip();
        let own = ready(&clip, false, &LabelFiles::default());
        let mirrored = ready(&clip, true, &LabelFiles::default());
        for frame in inner(&own) {
            let [a, b, c, d] = own.labels.contacts.soles[frame];
            assert_eq!(mirrored.labels.contacts.soles[frame], [c, d, a, b], "frame {frame}");
            let phases = [&own, &mirrored].map(|r| f64::from(r.labels.phase.at(frame)));
            assert!(apart(phases[0] + 0.5, phases[1]) < 1e-4, "{phases:?}");
            assert_eq!(own.labels.gaits.categories[frame], mirrored.labels.gaits.categories[frame]);
            let (there, here) = (own.motion.root(frame), mirrored.motion.root(frame));
            assert!((there.position.x + here.position.x).abs() < 1e-4);
            assert!((there.facing.x + here.facing.x).abs() < 1e-4);
        }
    }
}

/// The hips of a published clip whose children all lie in one point with them were turned by half a
/// turn in its mirror image, because it happens to walk along X: which of several reflections a
/// joint's frame gets must not depend on that.
#[test]
fn mirrored_rotations_do_not_depend_on_where_a_clip_walks() {
    use ambulo_rig::glam::DVec3;
    use ambulo_rig::{Clip, Skeleton};
    for heading in [0.0, 1.6, 3.0, 4.7] {
        let clip = Walker { heading, ..WALK }.clip();
        let mut joints = clip.skeleton().joints().to_vec();
        let mut setup = setup("ambulo");
        // As in CMU's skeletons: nothing that hangs on the hips is off them, and joints that move
        // have no offset to tell sides by either.
        joints.iter_mut().filter(|joint| joint.parent == Some(0)).for_each(|joint| {
            joint.offset = DVec3::ZERO;
        });
        setup.skeleton = Skeleton::new(joints.clone()).unwrap();
        let frames = 0..clip.frames();
        let mut translations = vec![];
        for frame in frames.clone() {
            let moved = clip.translations(frame);
            let thigh = |side: f64| DVec3::new(0.1 * side, -0.05, 0.0);
            translations.extend([moved[0], thigh(1.0), moved[1], thigh(-1.0), moved[2]]);
        }
        let rotations = frames.flat_map(|frame| clip.rotations(frame).to_vec()).collect();
        let skeleton = setup.skeleton.clone();
        let clip = Clip::new(skeleton, 1.0 / FPS, vec![0, 1, 3, 5, 7], translations, rotations);
        let fitted = setup.fit(&clip.unwrap(), "ambulo", None, None).unwrap();
        let mirrored = setup.label(&fitted, FPS, true, &LabelFiles::default()).unwrap();
        let root = mirrored.motion.root(100).rotation();
        let turn = root.inverse() * mirrored.motion.rotation(100, 0);
        assert!(turn.to_axis_angle().1.abs() < 0.1, "hips turned {turn} at heading {heading}");
    }
}

#[test]
fn steps_of_ones_own_count() {
    let clip = WALK.clip();
    let own = ready(&clip, false, &given("step left 3.0\nstep right 3.6\nstep left 4.2\n"));
    let at =
        |ready: &Ready, seconds: f64| f64::from(ready.labels.phase.at((seconds * FPS) as usize));
    assert!(apart(at(&own, 3.0), 0.5) < 0.01 && apart(at(&own, 3.3), 0.75) < 0.01);
    assert!(apart(at(&own, 3.6), 0.0) < 0.01);
    // The mirror image has the same steps with the other foot.
    let mirrored = ready(&clip, true, &given("step left 3.0\nstep right 3.6\nstep left 4.2\n"));
    assert!(apart(at(&mirrored, 3.6), 0.5) < 0.01);
}

#[test]
fn gaits_and_gaps_of_ones_own_count() {
    let own = ready(&WALK.clip(), false, &given("gait jog 2 4\nskip 5 6\n"));
    assert_eq!(own.labels.gaits.categories[180], 2);
    assert!(own.labels.gaits.shares[180][2] > 0.99 && own.labels.gaits.confidence[180] == 1.0);
    assert_eq!(own.labels.gaits.categories[270], 1);
    assert!(own.labels.usable[299] && !own.labels.usable[300] && !own.labels.usable[359]);
    assert!(own.labels.usable[361]);
}

/// They were ignored where a published phase lay beside the clip.
#[test]
fn steps_of_ones_own_count_before_published_ones() {
    let clip = WALK.clip();
    let mut files = given("step left 3.0\nstep right 3.6\nstep left 4.2\n");
    let phase = (0..clip.frames()).map(|i| (i % 60) as f32 / 60.0).collect();
    let cycles = (0..8).map(|i| [0.0, 30.0, 60.0].map(|at| at + 60.0 * f64::from(i))).collect();
    files.published = Some(Published { phase, gaits: vec![], cycles });
    let own = ready(&clip, false, &files);
    assert!(apart(f64::from(own.labels.phase.at(198)), 0.75) < 0.01);
    files.given = None;
    let published = ready(&clip, false, &files);
    assert!(apart(f64::from(published.labels.phase.at(198)), 18.0 / 60.0) < 0.01);
}

#[test]
fn labels_written_for_people_are_read_again() {
    let own = found(&WALK);
    let text = own.labels.to_text(FPS as f32);
    let again = Given::parse(&text).unwrap();
    assert!(again.steps.len() > 10 && again.gaits.len() == 1, "{text}");
    let twice = ready(&WALK.clip(), false, &given(&text));
    for frame in inner(&own) {
        let phases = [&own, &twice].map(|r| f64::from(r.labels.phase.at(frame)));
        assert!(apart(phases[0], phases[1]) < 1e-3);
    }
}

/// A part of a file has the labels of that part: times count from the file's beginning.
#[test]
fn parts_of_files_keep_the_files_times() {
    let setup = setup("ambulo");
    let clip = WALK.clip();
    let files = given("skip 3 4\nstep right 5.0\nstep left 5.5\nstep right 6.0");
    let fitted = setup.fit(&clip, "ambulo", Some(2.0), Some(7.0)).unwrap();
    let part = setup.label(&fitted, FPS, false, &files).unwrap();
    assert_eq!(part.motion.frames(), 300);
    assert!(part.labels.usable[59] && !part.labels.usable[60] && part.labels.usable[121]);
    assert!(apart(f64::from(part.labels.phase.at(210)), 0.5) < 0.01);
    let late = setup.fit(&clip, "ambulo", Some(9.0), None).unwrap_err();
    assert!(late.contains("only 7.98 s"), "{late}");
}
