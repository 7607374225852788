//! Motion of one made-up person on others: limbs, feet, sides, and back again.

mod people;

use ambulo_rig::glam::{DQuat, EulerRot, Quat, Vec3};
use ambulo_rig::{
    Clip, Joint, Pose, Retarget, RetargetError, Roles, Skeleton, Stance, Transform, palm,
};
use people::{SOLE, a_pose, arms, find, global, plain, planted, splayed, standing};
use proptest::prelude::*;

fn carried(from: &Stance<'_>, to: &Stance<'_>, pose: &Pose) -> (Pose, Vec<Transform>, f32) {
    let mut retarget = Retarget::new(from, to).unwrap();
    let mut made = retarget.skeleton().rest_pose();
    retarget.pose(pose, &mut made);
    let places = global(retarget.skeleton(), &made);
    (made, places, retarget.scale())
}

fn plainly(skeleton: &Skeleton) -> Stance<'_> {
    Stance::rest(skeleton).with_sole(SOLE)
}

fn poses() -> Vec<Pose> {
    let sit = standing(1.3, 1.0, arms(0.9));
    // As far apart as the legs reach: the hips of most others must be lower.
    let stride = planted(Vec3::new(0.0, 0.883, 0.0), [[0.22, 0.32], [-0.22, -0.32]]);
    vec![standing(0.05, 0.1, arms(-1.3)), standing(0.5, -0.4, arms(1.2)), sit, stride]
}

/// Degrees between the bones from `a` to `b`.
fn apart(ours: [&[Transform]; 2], bones: [[usize; 2]; 2]) -> f32 {
    let bone = |i: usize| ours[i][bones[i][1]].translation - ours[i][bones[i][0]].translation;
    bone(0).angle_between(bone(1)).to_degrees()
}

#[test]
fn on_itself_a_pose_is_what_it_was() {
    for skeleton in [plain(), splayed(), a_pose()] {
        for seed in 0..20 {
            let angle = |i: usize| (i as f32 * 1.7 + seed as f32).sin() * 1.2;
            let mut pose = skeleton.rest_pose();
            for (i, joint) in pose.local.iter_mut().enumerate() {
                let helper = ["Joint", "Twist", "Roll", "Finger", "Index", "Middle", "LowerBack"];
                let name = &skeleton.joints()[i].name;
                if !helper.iter().any(|word| name.contains(word)) {
                    joint.rotation =
                        Quat::from_euler(EulerRot::YXZ, angle(i), angle(i + 9), angle(i + 31));
                }
            }
            pose.local[0].translation = Vec3::new(0.3, 0.7, -0.2);
            let (made, ..) = carried(&plainly(&skeleton), &plainly(&skeleton), &pose);
            for (i, (a, b)) in pose.local.iter().zip(&made.local).enumerate() {
                let same = a.rotation.dot(b.rotation).abs() > 1.0 - 1e-6
                    && (a.rotation * a.rotation.dot(b.rotation).signum())
                        .abs_diff_eq(b.rotation, 1e-5);
                let name = &skeleton.joints()[i].name;
                assert!(same, "{seed} {name} {:?} {:?}", a.rotation, b.rotation);
                assert!(a.translation.abs_diff_eq(b.translation, 1e-5), "{seed} {name}");
            }
        }
    }
}

#[test]
fn limbs_point_the_same_way_and_feet_stand_where_they_stood() {
    let from = plain();
    for to in [splayed(), a_pose()] {
        let names = |joint: usize| {
            let found =
                ["LowerArm", "ForeArm"].map(|word| to.find(&format!("{}{word}", SIDES[joint])));
            found[0].or(found[1]).unwrap()
        };
        let (theirs, ours) = (Roles::by_name(&from), Roles::by_name(&to));
        for pose in poses() {
            let (_, places, scale) = carried(&plainly(&from), &plainly(&to), &pose);
            let source = global(&from, &pose);
            for side in 0..2 {
                let elbows = [find(&from, &format!("{}ForeArm", SIDES[side])), names(side)];
                let (arm, hand) = (theirs.arms.unwrap()[side], theirs.hands.unwrap()[side]);
                let (our_arm, our_hand) = (ours.arms.unwrap()[side], ours.hands.unwrap()[side]);
                let both: [&[Transform]; 2] = [&source, &places];
                assert!(apart(both, [[arm, elbows[0]], [our_arm, elbows[1]]]) < 1.0);
                assert!(apart(both, [[elbows[0], hand], [elbows[1], our_hand]]) < 1.0);
                let ball = places[ours.toes.unwrap()[side]].translation;
                let wanted = source[theirs.toes.unwrap()[side]].translation * scale;
                assert!((ball - wanted).with_y(0.0).length() < 1e-3, "{ball} {wanted}");
                assert!((ball.y - SOLE).abs() < 1e-3, "{ball}");
                let foot = ours.feet.unwrap()[side];
                let (toe, their_toe) = (ours.toes.unwrap()[side], theirs.toes.unwrap()[side]);
                let ahead = |places: &[Transform], [ankle, toe]: [usize; 2]| {
                    (places[toe].translation - places[ankle].translation).with_y(0.0)
                };
                let heading = ahead(&places, [foot, toe]);
                let their_heading = ahead(&source, [theirs.feet.unwrap()[side], their_toe]);
                assert!(heading.angle_between(their_heading) < 0.01, "{heading}");
                let up = places[foot].rotation * Vec3::Y;
                assert!(up.angle_between(Vec3::Y) < 0.01, "flat: {up}");
                let thigh = places[ours.thighs.unwrap()[side]].translation;
                let theirs = source[theirs.thighs.unwrap()[side]].translation * scale;
                assert!((thigh - theirs).length() < 0.02, "{thigh} {theirs}");
            }
        }
    }
}

const SIDES: [&str; 2] = ["Left", "Right"];

#[test]
fn a_raised_left_hand_is_a_left_hand_raised() {
    let pose = standing(0.1, 0.0, [Quat::from_rotation_z(1.3), Quat::from_rotation_z(1.3)]);
    for to in [plain(), splayed(), a_pose()] {
        let from = plain();
        let (_, places, _) = carried(&plainly(&from), &Stance::rest(&to), &pose);
        let height = |name: &str| places[find(&to, name)].translation.y;
        let (left, right) = (height("LeftHand"), height("RightHand"));
        assert!(left > height("Head") && right < height("LeftShoulder"), "{left} {right}");
        assert!(places[find(&to, "LeftHand")].translation.x > 0.0);
    }
}

#[test]
fn hips_are_above_the_thighs_where_they_are_on_the_source() {
    let (from, to) = (plain(), splayed());
    let pose = standing(0.1, 0.0, arms(0.0));
    let (_, places, _) = carried(&plainly(&from), &plainly(&to), &pose);
    let [hips, left, right, back] = ["Hips", "LeftUpLeg", "RightUpLeg", "Spine"]
        .map(|name| places[find(&to, name)].translation);
    let thighs = left.midpoint(right);
    // At rest they are 5 cm behind, and the trunk would be with them.
    assert!((hips - thighs).with_y(0.0).length() < 1e-4, "{hips} {thighs}");
    assert!((back - hips).abs_diff_eq(Vec3::new(0.0, 0.11, -0.01), 1e-4), "{back} {hips}");
}

#[test]
fn there_and_back_again() {
    let from = plain();
    for to in [splayed(), a_pose()] {
        // Not the last: legs at full stretch are lowered and come back a little bent.
        for pose in &poses()[..3] {
            let (there, ..) = carried(&plainly(&from), &plainly(&to), pose);
            let (back, ..) = carried(&plainly(&to), &plainly(&from), &there);
            for (joint, (a, b)) in pose.local.iter().zip(&back.local).enumerate() {
                let name = &from.joints()[joint].name;
                let angle = a.rotation.angle_between(b.rotation).to_degrees();
                // A trunk of fewer joints bends elsewhere.
                let trunk = ["Spine", "Neck", "Head"].iter().any(|word| name.contains(word));
                let most = if trunk { 6.0 } else { 2.0 };
                assert!(angle < most, "{name}: {angle}°");
            }
            let moved = pose.local[0].translation.distance(back.local[0].translation);
            assert!(moved < 0.01, "{moved}");
        }
    }
}

#[test]
fn planted_feet_of_a_clip_do_not_slide() {
    let from = plain();
    let frames: Vec<_> = (0..120)
        .map(|frame| {
            let time = frame as f32 / 60.0;
            let sway = Vec3::new(0.08 * (4.0 * time).sin(), 0.85, 0.1 * (5.0 * time).cos());
            planted(sway, [[0.12, 0.1], [-0.15, -0.2]])
        })
        .collect();
    let rotations = frames.iter().flat_map(|pose| pose.local.iter());
    let rotations: Vec<DQuat> = rotations.map(|joint| joint.rotation.as_dquat()).collect();
    let moved = frames.iter().map(|pose| pose.local[0].translation.as_dvec3()).collect();
    let clip = Clip::new(from.clone(), 1.0 / 60.0, vec![0], moved, rotations).unwrap();
    for to in [splayed(), a_pose()] {
        let mut retarget = Retarget::new(&plainly(&from), &plainly(&to)).unwrap();
        let made = retarget.clip(&clip).unwrap();
        assert_eq!((made.frames(), made.fps()), (clip.frames(), clip.fps()));
        let (mut before, mut after) = (vec![], vec![]);
        let roles = Roles::by_name(&to);
        made.positions(0, &mut before);
        for frame in 1..made.frames() {
            made.positions(frame, &mut after);
            for joint in roles.feet.unwrap().into_iter().chain(roles.toes.unwrap()) {
                let slid = before[joint].distance(after[joint]);
                assert!(slid < 0.0003, "frame {frame}: {slid} m");
            }
        }
        let other = clip.scaled(2.0);
        assert_eq!(retarget.clip(&other).unwrap_err(), RetargetError::OtherSkeleton);
    }
}

#[test]
fn a_stance_may_be_posed() {
    // The arms of the skeleton at rest hang straight down; posed, it stands in T.
    let from = plain();
    let hanging = from.joints().iter().map(|joint| {
        let arm = ["ForeArm", "Hand"].iter().any(|word| joint.name.contains(word));
        let down = ambulo_rig::glam::DVec3::new(0.0, -joint.offset.length(), 0.0);
        Joint { offset: if arm { down } else { joint.offset }, ..joint.clone() }
    });
    let to = Skeleton::new(hanging.collect()).unwrap();
    let mut stance = to.rest_pose();
    stance.local[find(&to, "LeftArm")].rotation = Quat::from_rotation_z(1.5707964);
    stance.local[find(&to, "RightArm")].rotation = Quat::from_rotation_z(-1.5707964);
    for pose in poses() {
        let (_, places, _) = carried(&plainly(&from), &plainly(&to).posed(&stance), &pose);
        for (ours, theirs) in places.iter().zip(global(&from, &pose)) {
            assert!(ours.translation.abs_diff_eq(theirs.translation, 1e-4));
        }
    }
}

#[test]
fn what_is_no_humanoid_is_refused() {
    let (person, turned) = (plain(), plain());
    let mut pose = turned.rest_pose();
    pose.local[0].rotation = Quat::from_rotation_y(3.0);
    let away = Retarget::new(&Stance::rest(&person), &Stance::rest(&turned).posed(&pose));
    let refused = away.unwrap_err();
    assert_eq!(refused, RetargetError::To("a stance that is not upright, facing +Z"));
    let hips = person.joints()[..1].to_vec();
    let hips = Skeleton::new(hips).unwrap();
    let none = Retarget::new(&Stance::rest(&hips), &Stance::rest(&person)).unwrap_err();
    assert_eq!(none.to_string(), "the skeleton that motion comes from has no legs of two bones");
    let deep = |sole| Retarget::new(&Stance::rest(&person), &Stance::rest(&turned).with_sole(sole));
    assert!(deep(0.0).is_ok() && deep(-0.1).is_err() && deep(f32::NAN).is_err());
    pose.local[3].rotation = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let broken = Retarget::new(&Stance::rest(&person), &Stance::rest(&turned).posed(&pose));
    assert_eq!(broken.unwrap_err(), RetargetError::To("a stance that is not finite"));
    // What a file holds in f64 may be more than a pose can.
    let far = vec![ambulo_rig::glam::DVec3::splat(1e300)];
    let clip = Clip::new(person.clone(), 0.1, vec![0], far, vec![DQuat::IDENTITY; 22]).unwrap();
    let refused = deep(0.0).unwrap().clip(&clip).unwrap_err();
    assert!(matches!(refused, RetargetError::TooLarge(_)));
}

#[test]
fn a_palm_is_under_the_hand() {
    let person = plain();
    let left = palm(&person, &Roles::by_name(&person), 0).unwrap();
    let right = palm(&person, &Roles::by_name(&person), 1).unwrap();
    assert!(left.translation.abs_diff_eq(Vec3::new(0.08, -0.02, 0.0), 5e-4), "{left:?}");
    assert!(right.translation.abs_diff_eq(Vec3::new(-0.08, -0.02, 0.0), 5e-4), "{right:?}");
    for (palm, fingers) in [(left, Vec3::X), (right, Vec3::NEG_X)] {
        assert!((palm.rotation * Vec3::Z).abs_diff_eq(fingers, 1e-6));
        assert!((palm.rotation * Vec3::Y).abs_diff_eq(Vec3::Y, 1e-6));
    }
    // A first bone of 4 cm is no hand; 13 cm of fingers are.
    let length = |skeleton: &Skeleton| {
        let palm = palm(skeleton, &Roles::by_name(skeleton), 0).unwrap();
        (palm.rotation.inverse() * palm.translation).z / 0.63
    };
    assert!((length(&splayed()) - 0.1).abs() < 1e-3);
    assert!((length(&a_pose()) - 0.136).abs() < 1e-3);
    let legs = Skeleton::new(person.joints()[..5].to_vec()).unwrap();
    assert_eq!(palm(&legs, &Roles::by_name(&legs), 0), None);
}

#[test]
fn how_long_a_pose_takes() {
    let (from, to) = (plain(), splayed());
    let mut retarget = Retarget::new(&Stance::rest(&from), &Stance::rest(&to)).unwrap();
    let (pose, mut made) = (standing(0.5, 0.3, arms(1.0)), to.rest_pose());
    let start = std::time::Instant::now();
    for _ in 0..10_000 {
        retarget.pose(std::hint::black_box(&pose), &mut made);
    }
    let each = start.elapsed().as_secs_f64() * 100.0;
    println!("{} to {} joints: {each:.2} µs a pose", from.len(), to.len());
}

proptest! {
    #[test]
    fn any_pose_gives_finite_numbers(
        turns in prop::collection::vec(prop::array::uniform4(-1.0..1.0f32), 22),
        place in prop::array::uniform3(-5.0..5.0f32),
    ) {
        let from = plain();
        let mut pose = from.rest_pose();
        for (joint, [x, y, z, w]) in pose.local.iter_mut().zip(turns) {
            let turn = Quat::from_xyzw(x, y, z, w);
            joint.rotation = if turn.length() > 1e-3 { turn.normalize() } else { Quat::IDENTITY };
        }
        pose.local[0].translation = Vec3::from_array(place);
        for to in [splayed(), a_pose()] {
            let (made, places, _) = carried(&plainly(&from), &Stance::rest(&to), &pose);
            let unit = |joint: &Transform| joint.is_finite() && joint.rotation.is_normalized();
            prop_assert!(made.local.iter().all(unit));
            let moving = Roles::by_name(&to).hips.unwrap();
            for (i, (own, joint)) in made.local.iter().zip(to.joints()).enumerate() {
                let kept = i == 0 || i == moving || own.translation == joint.offset.as_vec3();
                prop_assert!(kept, "{} keeps its length", joint.name);
            }
            prop_assert!(places.iter().all(|place| place.is_finite()));
        }
    }
}
