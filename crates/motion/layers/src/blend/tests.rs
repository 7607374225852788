use super::*;
use ambulo_rig::glam::DVec3;
use ambulo_rig::{Joint, Skeleton};
use proptest::prelude::*;

const JOINTS: usize = 3;

fn mask(weights: [f32; JOINTS]) -> Mask {
    let joint = |index: usize| Joint {
        name: index.to_string(),
        parent: index.checked_sub(1),
        offset: DVec3::Y,
        tips: vec![],
    };
    let skeleton = Skeleton::new((0..JOINTS).map(joint).collect()).unwrap();
    Mask::from_weights(&skeleton, weights.to_vec()).unwrap()
}

fn pose() -> impl Strategy<Value = Pose> {
    let numbers = prop::array::uniform4(-1.0..1.0f32);
    let joint = (prop::array::uniform3(-2.0..2.0f32), numbers).prop_map(|(place, turn)| {
        let turn = Vec4::from_array(turn).normalize_or(Vec4::W);
        Transform::new(Vec3::from_array(place), Quat::from_vec4(turn))
    });
    prop::collection::vec(joint, JOINTS).prop_map(|local| Pose { local })
}

fn none() -> Pose {
    Pose { local: vec![] }
}

fn rest() -> Pose {
    Pose { local: vec![Transform::IDENTITY; JOINTS] }
}

fn alike(a: &Pose, b: &Pose, tolerance: f32) -> bool {
    a.local.iter().zip(&b.local).all(|(a, b)| {
        a.translation.abs_diff_eq(b.translation, tolerance)
            && a.rotation.dot(b.rotation).abs() > 1.0 - tolerance
    })
}

fn all<'a>(pose: &'a Pose, weight: f32) -> Layer<'a> {
    Layer { pose, weight, mask: None }
}

proptest! {
    #[test]
    fn a_single_weight_is_exact(a in pose(), b in pose(), weight in 0.01..5.0f32) {
        let mut out = none();
        weighted([all(&a, weight), all(&b, 0.0)], &rest(), &mut out).unwrap();
        prop_assert_eq!(&out, &a);
        weighted([all(&a, 1e-9), all(&b, weight)], &rest(), &mut out).unwrap();
        prop_assert_eq!(&out, &b);
        cross_fade(&a, &b, 0.0, None, &mut out).unwrap();
        prop_assert_eq!(&out, &a);
        cross_fade(&a, &b, 1.5, None, &mut out).unwrap();
        prop_assert_eq!(&out, &b);
        additive(&a, &b, 0.0, None, &mut out).unwrap();
        prop_assert_eq!(&out, &a);
    }

    #[test]
    fn the_size_of_weights_does_not_count_and_signs_do_not(
        a in pose(), b in pose(), c in pose(), weights in prop::array::uniform3(0.1..1.0f32),
    ) {
        let layers = |scale: f32| [(&a, 0), (&b, 1), (&c, 2)].map(|(p, i)| all(p, weights[i] * scale));
        let (mut one, mut two) = (none(), none());
        weighted(layers(1.0), &rest(), &mut one).unwrap();
        weighted(layers(7.0), &rest(), &mut two).unwrap();
        prop_assert!(alike(&one, &two, 1e-4));
        prop_assert!(one.local.iter().all(|joint| (joint.rotation.length() - 1.0).abs() < 1e-5));
        let mut other = b.clone();
        other.local.iter_mut().for_each(|joint| joint.rotation = -joint.rotation);
        let layers = [all(&a, weights[0]), all(&other, weights[1]), all(&c, weights[2])];
        weighted(layers, &rest(), &mut two).unwrap();
        prop_assert!(alike(&one, &two, 1e-4));
    }

    #[test]
    fn a_difference_added_to_its_reference_is_the_pose(a in pose(), b in pose(), c in pose()) {
        let (mut more, mut out) = (none(), none());
        difference(&a, &b, &mut more).unwrap();
        additive(&b, &more, 1.0, None, &mut out).unwrap();
        prop_assert!(alike(&out, &a, 1e-4));
        // And takes itself away again.
        additive(&c, &more, 0.7, None, &mut out).unwrap();
        let mut back = none();
        additive(&out, &more, -0.7, None, &mut back).unwrap();
        prop_assert!(alike(&back, &c, 1e-4));
    }
}

#[test]
fn two_equal_weights_meet_halfway() {
    let turned = |angle: f32| Pose {
        local: vec![Transform::new(Vec3::X * angle, Quat::from_rotation_y(angle)); JOINTS],
    };
    let (mut mean, mut fade) = (none(), none());
    let (a, b) = (turned(0.2), turned(1.4));
    weighted([all(&a, 2.0), all(&b, 2.0)], &rest(), &mut mean).unwrap();
    cross_fade(&a, &b, 0.5, None, &mut fade).unwrap();
    assert!(alike(&mean, &turned(0.8), 1e-6) && alike(&fade, &turned(0.8), 1e-6));
    let mut third = none();
    additive(&a, &b, 1.0 / 3.0, None, &mut third).unwrap();
    let angle = 0.2 + 1.4 / 3.0;
    assert!(alike(&third, &turned(angle), 1e-6), "{third:?}");
}

#[test]
fn masks_keep_joints_out() {
    let moved = Pose { local: vec![Transform::new(Vec3::X, Quat::from_rotation_x(1.0)); JOINTS] };
    let mask = mask([0.0, 0.5, 1.0]);
    let half = rest().local[1].interpolate(moved.local[1], 0.5);
    let expected = Pose { local: vec![rest().local[0], half, moved.local[2]] };
    let mut out = none();
    cross_fade(&rest(), &moved, 1.0, Some(&mask), &mut out).unwrap();
    assert_eq!(out, expected);
    additive(&rest(), &moved, 1.0, Some(&mask), &mut out).unwrap();
    assert!(alike(&out, &expected, 1e-6));
    // Where the mask leaves nothing, the rest shows.
    let layer = Layer { pose: &moved, weight: 1.0, mask: Some(&mask) };
    weighted([layer], &rest(), &mut out).unwrap();
    assert_eq!(out.local, [rest().local[0], moved.local[1], moved.local[2]]);
}

#[test]
fn broken_input_leaves_the_output() {
    let mut broken = rest();
    broken.local[2].translation.y = f32::NAN;
    let (good, mut out) = (rest(), rest());
    out.local[1].translation.x = 5.0;
    let before = out.clone();
    let refused = Err(Refused::Joint { joint: 2 });
    assert_eq!(cross_fade(&good, &broken, 0.5, None, &mut out), refused);
    assert_eq!(weighted([all(&broken, 0.0)], &good, &mut out), refused);
    assert_eq!(difference(&broken, &good, &mut out), refused);
    assert_eq!(additive(&good, &broken, 0.5, None, &mut out), refused);
    for bad in [f32::NAN, f32::INFINITY] {
        assert!(cross_fade(&good, &good, bad, None, &mut out).is_err());
        assert!(additive(&good, &good, bad, None, &mut out).is_err());
        assert!(weighted([all(&good, bad)], &good, &mut out).is_err());
    }
    assert!(weighted([all(&good, -0.1)], &good, &mut out).is_err());
    assert!(cross_fade(&good, &none(), 0.5, None, &mut out).is_err());
    assert_eq!(out, before);
}
