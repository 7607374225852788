//! Angles about axes ↔ rotations.

use ambulo_rig::glam::{DMat3, DQuat};

/// `rotation` followed, in its own frame, by a turn of `degrees` about an axis (0, 1, 2).
#[inline]
pub(crate) fn turned(rotation: DQuat, axis: usize, degrees: f64) -> DQuat {
    // Beyond a few turns, radians would lose what the text had.
    let degrees = if degrees.abs() > 720.0 { degrees % 720.0 } else { degrees };
    let (sin, cos) = (degrees.to_radians() * 0.5).sin_cos();
    let DQuat { x, y, z, w } = rotation;
    match axis {
        0 => DQuat::from_xyzw(
            x * cos + w * sin,
            y * cos + z * sin,
            z * cos - y * sin,
            w * cos - x * sin,
        ),
        1 => DQuat::from_xyzw(
            x * cos - z * sin,
            y * cos + w * sin,
            z * cos + x * sin,
            w * cos - y * sin,
        ),
        _ => DQuat::from_xyzw(
            x * cos + y * sin,
            y * cos - x * sin,
            z * cos + w * sin,
            w * cos - z * sin,
        ),
    }
}

/// Below this cosine of the middle angle the first and the third turn about one axis, for all
/// that can be told: their split is rounding noise. At 5e-7 that noise stays under a tenth of the
/// sixth decimal, and setting the third to 0 turns the joint by no more than 6e-5 degrees.
const LOCK: f64 = 5e-7;

/// Millionths of degrees about up to three different axes, in (-180°, 180°], that compose to a
/// rotation as well as turns about these axes can.
///
/// What is read back from the result gives the same result again.
pub(crate) fn angles(rotation: DQuat, axes: &[usize]) -> [i64; 3] {
    let m = DMat3::from_quat(rotation);
    let entry = |row: usize, column: usize| m.col(column)[row];
    let Some(&i) = axes.first() else { return [0; 3] };
    let j = axes.get(1).copied().unwrap_or((i + 1) % 3);
    let k = 3 - i - j;
    let sign = if j == (i + 1) % 3 { 1.0 } else { -1.0 };
    // With no third turn, the middle axis is moved by the first alone.
    let alone = |a: f64, b: i64| [micro(a), b, 0];
    let first_alone = (sign * entry(k, j)).atan2(entry(j, j));
    match axes.len() {
        1 => alone(first_alone, 0),
        2 => alone(first_alone, micro((sign * entry(i, k)).atan2(entry(i, i)))),
        _ => {
            // For i, j, k = x, y, z: R = | cos b cos c, -cos b sin c, sin b | and so on.
            let b = micro((sign * entry(i, k)).atan2(entry(i, i).hypot(entry(i, j))));
            // Decided on what will be read back, so that it is decided alike every time.
            if degrees(b).to_radians().cos().abs() < LOCK {
                return alone(first_alone, b);
            }
            let a = (-sign * entry(j, k)).atan2(entry(k, k));
            let c = (-sign * entry(i, j)).atan2(entry(i, i));
            [micro(a), b, micro(c)]
        }
    }
}

/// Millionths of degrees in (-180°, 180°].
fn micro(radians: f64) -> i64 {
    let micro = (radians.to_degrees() * 1e6).round() as i64;
    if micro <= -180_000_000 { micro + 360_000_000 } else { micro }
}

pub(crate) fn degrees(micro: i64) -> f64 {
    micro as f64 / 1e6
}

/// The rotation that such angles say.
pub(crate) fn composed(angles: [i64; 3], axes: &[usize]) -> DQuat {
    let turns = axes.iter().zip(angles);
    turns.fold(DQuat::IDENTITY, |rotation, (&axis, angle)| turned(rotation, axis, degrees(angle)))
}

/// Degrees between two rotations, to the last digits also where it is small.
pub(crate) fn apart(a: DQuat, b: DQuat) -> f64 {
    let between = a.conjugate() * b;
    let sine = between.xyz().length();
    (2.0 * sine.atan2(between.w.abs())).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::glam::DVec3;
    use proptest::prelude::*;

    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

    #[test]
    fn turns_compose_left_to_right_about_the_turned_axes() {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z];
        for order in ORDERS {
            let given = [31.0, -72.0, 118.0_f64];
            let turn = |n: usize| DQuat::from_axis_angle(axis[order[n]], given[n].to_radians());
            let expected = turn(0) * turn(1) * turn(2);
            let rotation =
                (0..3).fold(DQuat::IDENTITY, |rotation, n| turned(rotation, order[n], given[n]));
            assert!(apart(rotation, expected) < 1e-12);
        }
        let many = turned(DQuat::IDENTITY, 0, 3600.0 * 1e6 + 90.0);
        assert!(apart(many, DQuat::from_rotation_x(90_f64.to_radians())) < 1e-9);
    }

    /// Angles where extraction is delicate, and any others.
    fn angle() -> impl Strategy<Value = f64> {
        const SEAMS: [f64; 9] = [0.0, 90.0, -90.0, 180.0, -180.0, 270.0, 360.0, 89.9999, 45.0];
        let near = (prop::sample::select(&SEAMS[..]), -60..60_i32);
        prop_oneof![
            near.clone().prop_map(|(seam, steps)| seam + f64::from(steps) * 1e-6),
            near.clone().prop_map(|(seam, steps)| seam + f64::from(steps) * 1e-7),
            near.prop_map(|(seam, power)| seam + 10_f64.powi(-power.abs() / 4)),
            -400.0..400.0,
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn angles_say_the_rotation_and_stay_as_they_are(
            order in prop::sample::select(&ORDERS[..]), count in 1..4_usize,
            a in angle(), b in angle(), c in angle(),
        ) {
            let axes = &order[..count];
            let turns = axes.iter().zip([a, b, c]);
            let rotation = turns.fold(DQuat::IDENTITY, |r, (&axis, angle)| turned(r, axis, angle));
            let found = angles(rotation, axes);
            prop_assert!(found.iter().all(|a| (-179_999_999..=180_000_000).contains(a)));
            let again = composed(found, axes);
            prop_assert!(apart(again, rotation) < 1e-4, "{} degrees off", apart(again, rotation));
            prop_assert_eq!(angles(again, axes), found, "read back, it is written alike");
        }
    }
}
