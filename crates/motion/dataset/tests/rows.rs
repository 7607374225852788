//! What the numbers of a row mean, read back through the layout.

mod common;

use std::f32::consts::TAU;

use ambulo_dataset::prepare::LabelFiles;
use ambulo_dataset::rows::{ClipRows, encode_clip};
use ambulo_features::{Input, Layout, Output};
use ambulo_rig::Clip;
use ambulo_rig::glam::{Vec2, Vec3};
use common::{BACKWARD, FPS, HEEL, JOG, JOINTS, TO_THE_LEFT, WALK, Walker, setup};

const LEADING: usize = 6;

struct Row {
    phase: f32,
    root: [f32; 4],
    input: Input,
    output: Output,
}

fn encoded(layout: &str, clip: &Clip, mirror: bool) -> ClipRows {
    let setup = setup(layout);
    let fitted = setup.fit(clip, "ambulo", None, None).unwrap();
    let ready = setup.label(&fitted, clip.fps(), mirror, &LabelFiles::default()).unwrap();
    encode_clip(&setup, &ready).unwrap()
}

fn decoded(name: &str, rows: &ClipRows) -> Vec<Row> {
    let layout = Layout::named(name, JOINTS).unwrap();
    let decode = |row: &[f32]| {
        let (x, y) = row[LEADING..].split_at(layout.input_len());
        let (mut input, mut output) = (Input::zero(JOINTS), Output::zero(JOINTS));
        layout.decode_input(x, &mut input);
        layout.decode_output(y, &mut output);
        Row { phase: row[0], root: row[2..6].try_into().unwrap(), input, output }
    };
    rows.rows.chunks(rows.width).map(decode).collect()
}

fn rows(layout: &str, walker: &Walker) -> Vec<Row> {
    decoded(layout, &encoded(layout, &walker.clip(), false))
}

/// The frame that a row is of: the first one has a second before it.
const FIRST: usize = 60;

#[track_caller]
fn near(a: f32, b: f64, within: f64, what: &str) {
    assert!((f64::from(a) - b).abs() <= within, "{what} is {a}, not {b}");
}

#[test]
fn velocity_and_turning_have_the_characters_signs() {
    for layout in ["ambulo", "holden"] {
        for (walker, x, z) in [
            (WALK, 0.0, 1.3),
            (BACKWARD, 0.0, -0.9),
            (TO_THE_LEFT, 0.8, 0.0),
            (Walker { turn: 0.7, ..WALK }, 0.0, 1.3),
            (Walker { turn: -0.7, ..WALK }, 0.0, 1.3),
        ] {
            let all = rows(layout, &walker);
            // The smoothed facing lags where the end values go on.
            for row in &all[60..all.len() - 60] {
                near(row.output.root_velocity.x, x, 0.01, "velocity to the left");
                near(row.output.root_velocity.y, z, 0.01, "velocity forward");
                near(row.output.yaw_rate, walker.turn, 0.01, "turning to the left");
                near(row.output.phase_rate, walker.cadence / 2.0, 0.1, "phase rate");
            }
        }
    }
}

#[test]
fn trajectories_are_seen_from_the_root() {
    for layout in ["ambulo", "holden"] {
        let walker = Walker { turn: 0.5, ..WALK };
        let all = rows(layout, &walker);
        for (index, row) in all.iter().enumerate().skip(60).step_by(17).take(12) {
            let time = (FIRST + index) as f64 / FPS;
            for sample in 0..12 {
                let ahead = (sample as f64 - 6.0) / 6.0;
                let off = walker.path(time + ahead) - walker.path(time);
                let (sin, cos) = walker.yaw(time).sin_cos();
                let point = &row.input.trajectory[sample];
                near(point.position.x, off.x * cos - off.z * sin, 0.01, "to the left");
                near(point.position.y, off.x * sin + off.z * cos, 0.01, "ahead");
                near(point.direction.x, (walker.turn * ahead).sin(), 0.01, "direction");
                near(point.direction.y, (walker.turn * ahead).cos(), 0.01, "direction");
            }
            // What comes next, from the next root: the same circle.
            for sample in 0..6 {
                let (ours, theirs) =
                    (row.input.trajectory[6 + sample], row.output.trajectory[sample]);
                assert!(ours.position.abs_diff_eq(theirs.position, 0.01));
                assert!(ours.direction.abs_diff_eq(theirs.direction, 0.01));
            }
        }
    }
}

#[test]
fn a_row_leads_to_the_next_one() {
    for layout in ["ambulo", "holden"] {
        let all = rows(layout, &Walker { turn: 0.4, ..WALK });
        for pair in all.windows(2) {
            let (now, next) = (&pair[0].output, &pair[1].input);
            for joint in 0..JOINTS {
                let (a, b) = (now.joint_position[joint], next.joint_position[joint]);
                assert!(a.abs_diff_eq(b, 1e-5), "joint {joint}: {a} then {b}");
                let (a, b) = (now.joint_velocity[joint], next.joint_velocity[joint]);
                assert!(a.abs_diff_eq(b, 1e-3), "joint {joint}: {a} then {b}");
            }
            // Root and phase go on as the output says.
            let [x, _, z, yaw] = pair[0].root;
            let step = Vec2::from_angle(-yaw).rotate(now.root_velocity / FPS as f32);
            let there = Vec2::new(x, z) + step;
            let next_root = pair[1].root;
            assert!(there.abs_diff_eq(Vec2::new(next_root[0], next_root[2]), 1e-4));
            let turned = yaw + now.yaw_rate / FPS as f32 - next_root[3];
            assert!((turned - TAU * (turned / TAU).round()).abs() < 1e-4);
            let phase = pair[0].phase + now.phase_rate / FPS as f32;
            assert!((phase - pair[1].phase - (phase - pair[1].phase).round()).abs() < 1e-4);
        }
    }
}

#[test]
fn joints_are_seen_from_the_root() {
    for layout in ["ambulo", "holden"] {
        for row in rows(layout, &WALK).iter().skip(30).take(200) {
            let place = &row.output.joint_position;
            assert!(place[0].abs_diff_eq(Vec3::new(0.0, 0.93, 0.0), 0.01), "hips {}", place[0]);
            assert!(place[1].x > 0.09 && place[5].x < -0.09, "left is +X");
            assert!(place[4].z > place[3].z, "toes are ahead of heels");
            let lower = place[3].y.min(place[7].y);
            near(lower, HEEL, 0.01, "the standing heel");
            // Everything moves as the root does, but for the feet.
            assert!(row.output.joint_velocity[12].abs_diff_eq(Vec3::new(0.0, 0.0, 1.3), 0.02));
            assert!(row.output.joint_rotation.iter().all(|q| q.to_axis_angle().1.abs() < 0.02));
            let heights = row.input.ground.iter().flat_map(|ground| ground.height);
            assert!(heights.into_iter().all(|height| height == 0.0));
        }
    }
}

/// The published layout's own contact test: 0.02 squared centimetres a frame.
#[test]
fn contacts_are_ones_and_zeros() {
    for layout in ["ambulo", "holden"] {
        let all = rows(layout, &WALK);
        let mut wrong = 0;
        for (index, row) in all.iter().enumerate() {
            let time = (FIRST + index) as f64 / FPS;
            for side in 0..2 {
                let toe = row.output.contacts[2 * side + 1];
                assert!(toe == 0.0 || toe == 1.0);
                wrong += usize::from((toe == 1.0) != WALK.down(side, time));
            }
        }
        let share = wrong as f64 / (2 * all.len()) as f64;
        assert!(share < 0.1, "{layout}: {:.1} %", 100.0 * share);
    }
}

#[test]
fn mirroring_twice_gives_the_rows_back() {
    use ambulo_rig::Mirror;
    use ambulo_rig::glam::DVec3;
    let clip = Walker { turn: 0.3, ..JOG }.clip();
    let mirror = Mirror::by_name(&clip, DVec3::X).unwrap().apply(&clip).unwrap();
    for layout in ["ambulo", "holden"] {
        let (once, twice) = (encoded(layout, &clip, false), encoded(layout, &mirror, true));
        assert_eq!(once.runs, twice.runs);
        for (a, b) in once.rows.iter().zip(&twice.rows) {
            assert!((a - b).abs() <= 1e-5 * a.abs().max(1.0), "{a} and {b}");
        }
    }
}

#[test]
fn a_mirrored_row_is_the_mirror_image() {
    const PARTNERS: [usize; JOINTS] = [0, 5, 6, 7, 8, 1, 2, 3, 4, 9, 11, 10, 12];
    let clip = Walker { turn: 0.3, ..WALK }.clip();
    for layout in ["ambulo", "holden"] {
        let rows = [false, true].map(|mirror| decoded(layout, &encoded(layout, &clip, mirror)));
        let [own, mirrored] = rows;
        assert_eq!(own.len(), mirrored.len());
        for (own, mirrored) in own.iter().zip(&mirrored).skip(60).take(200) {
            let (a, b) = (&own.output, &mirrored.output);
            assert!((a.yaw_rate + b.yaw_rate).abs() < 1e-3);
            assert!((a.root_velocity.x + b.root_velocity.x).abs() < 1e-3);
            assert!((a.root_velocity.y - b.root_velocity.y).abs() < 1e-3);
            let [c, d, e, f] = a.contacts;
            assert_eq!(b.contacts, [e, f, c, d]);
            for (joint, &partner) in PARTNERS.iter().enumerate() {
                let flip = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
                let (p, q) = (a.joint_position[joint], b.joint_position[partner]);
                assert!(flip(p).abs_diff_eq(q, 1e-4), "joint {joint}: {p} and {q}");
                let (p, q) = (a.joint_velocity[joint], b.joint_velocity[partner]);
                assert!(flip(p).abs_diff_eq(q, 5e-3), "joint {joint}: {p} and {q}");
            }
        }
    }
}

/// A file at another rate gives rows at the layout's.
#[test]
fn rates_are_converted() {
    let clip = WALK.clip().resampled(120.0).unwrap();
    let (fine, plain) = (encoded("ambulo", &clip, false), encoded("ambulo", &WALK.clip(), false));
    assert_eq!(fine.width, plain.width);
    assert!(fine.rows.len().abs_diff(plain.rows.len()) <= plain.width);
    for (a, b) in fine.rows.chunks(fine.width).zip(plain.rows.chunks(plain.width)).take(200) {
        // Phase may shift by a frame: steps are found on frames.
        assert!(a[1..].iter().zip(&b[1..]).filter(|(a, b)| (*a - *b).abs() > 0.02).count() < 9);
    }
}
