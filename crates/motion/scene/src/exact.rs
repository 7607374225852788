//! Rotations and directions whose bits are the same on every processor: what goes into the physics.
//!
//! glam multiplies quaternions with whatever vector instructions there are, and those add up in
//! different orders. Written out, every operation is one that IEEE 754 prescribes.

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec2, Vec3};

/// First `b`, then `a`.
pub(crate) fn product(a: Quat, b: Quat) -> Quat {
    let (u, v) = (vector(a), vector(b));
    let xyz = v * a.w + u * b.w + u.cross(v);
    Quat::from_xyzw(xyz.x, xyz.y, xyz.z, a.w * b.w - u.dot(v))
}

/// A vector, turned by a unit quaternion.
pub(crate) fn turned(rotation: Quat, v: Vec3) -> Vec3 {
    let u = vector(rotation);
    let across = u.cross(v) * 2.0;
    v + across * rotation.w + u.cross(across)
}

/// First `inner`, then `outer`.
pub(crate) fn compose(outer: Transform, inner: Transform) -> Transform {
    let translation = turned(outer.rotation, inner.translation) + outer.translation;
    Transform::new(translation, product(outer.rotation, inner.rotation))
}

/// The transform that undoes another.
pub(crate) fn inverse(of: Transform) -> Transform {
    let rotation = conjugate(of.rotation);
    Transform::new(turned(rotation, -of.translation), rotation)
}

/// Of length 1; not of length 0 before.
pub(crate) fn unit(q: Quat) -> Quat {
    let over = 1.0 / (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    Quat::from_xyzw(q.x * over, q.y * over, q.z * over, q.w * over)
}

/// Straight in translation and, closely enough for one step, in rotation.
pub(crate) fn between(a: Transform, b: Transform, t: f32) -> Transform {
    let (p, q) = (a.rotation, b.rotation);
    let same = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w;
    // Both signs are the same rotation: the nearer one.
    let (s, t_q) = (1.0 - t, if same < 0.0 { -t } else { t });
    let mix = |p: f32, q: f32| p * s + q * t_q;
    let mixed = Quat::from_xyzw(mix(p.x, q.x), mix(p.y, q.y), mix(p.z, q.z), mix(p.w, q.w));
    Transform::new(a.translation * s + b.translation * t, unit(mixed))
}

/// The turn from one rotation to another that is close, as axis times (twice the sine of half the)
/// angle.
pub(crate) fn turn(from: Quat, to: Quat) -> Vec3 {
    let turned = product(to, conjugate(from));
    vector(turned) * (2.0 * turned.w.signum())
}

/// (x, z) of a place.
pub(crate) fn level(place: Vec3) -> Vec2 {
    Vec2::new(place.x, place.z)
}

/// Where a yaw looks, (x, z).
pub(crate) fn ahead(yaw: f32) -> Vec2 {
    Vec2::new(libm::sinf(yaw), libm::cosf(yaw))
}

/// The imaginary part.
pub(crate) fn vector(q: Quat) -> Vec3 {
    Vec3::new(q.x, q.y, q.z)
}

fn conjugate(q: Quat) -> Quat {
    Quat::from_xyzw(-q.x, -q.y, -q.z, q.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_what_glam_says() {
        let a = Transform::new(Vec3::new(1.0, -2.0, 0.5), Quat::from_rotation_x(0.7));
        let b = Transform::new(Vec3::new(0.3, 0.2, 9.0), Quat::from_rotation_y(-2.1));
        let same = |a: Transform, b: Transform| {
            a.translation.abs_diff_eq(b.translation, 1e-5)
                && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-6
        };
        assert!(same(compose(a, b), a * b));
        assert!(same(inverse(a), a.inverse()));
        assert!(turned(a.rotation, b.translation).abs_diff_eq(a.rotation * b.translation, 1e-5));
        for t in [0.0, 0.3, 1.0] {
            let expected = a.rotation.lerp(b.rotation, t);
            let found = between(a, b, t);
            assert!(same(found, Transform::new(a.translation.lerp(b.translation, t), expected)));
            let other = Transform::new(b.translation, -b.rotation);
            assert!(same(between(a, other, t), found));
        }
        let little = turn(Quat::from_rotation_z(0.5), Quat::from_rotation_z(0.51));
        assert!(little.abs_diff_eq(Vec3::Z * 0.01, 1e-5));
    }
}
