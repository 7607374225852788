//! The place in all of some balls that is nearest to another one.
//!
//! It is that place itself, or it lies on the surface of one, two or three of the balls, nearest of
//! all points there (by Carathéodory's theorem no more are needed in space). So there are few to
//! compare: eight balls have 8 + 28 + 2 · 56, where projecting from ball to ball (Boyle, Dykstra,
//! 1986) takes a hundred rounds and is millimetres off where surfaces meet at a flat angle.
//!
//! Where no place is in all balls, they grow by the same length until there is one.

use ambulo_rig::glam::{DVec3, Vec3};

/// Centre and radius, metres.
pub(crate) type Ball = (Vec3, f32);

/// Halvings of the length by which balls grow: a metre to a micrometre.
const HALVINGS: usize = 20;

/// So far outside of a ball is on its surface, metres.
const ON: f64 = 1e-6;

/// The point in all balls that is nearest to `from`; where there is none, the one that is least
/// beyond them.
pub(crate) fn nearest(from: Vec3, balls: &[Ball]) -> Vec3 {
    let beyond = |&(centre, radius): &Ball| f64::from(from.distance(centre) - radius);
    let most = balls.iter().map(beyond).fold(0.0, f64::max);
    if most == 0.0 {
        return from;
    }
    let within = |grown: f64| on_surfaces(from.as_dvec3(), balls, grown);
    // Half the widest gap: enough for two, and nearly always for more.
    let pairs = (0..balls.len()).flat_map(|a| (0..a).map(move |b| (balls[a], balls[b])));
    let gap = |((a, radius_a), (b, radius_b)): (Ball, Ball)| {
        a.as_dvec3().distance(b.as_dvec3()) - f64::from(radius_a) - f64::from(radius_b)
    };
    let least = pairs.map(gap).fold(0.0, f64::max) / 2.0;
    if let Some(point) = within(least) {
        return point.as_vec3();
    }
    let (mut few, mut enough, mut best) = (least, most, from.as_dvec3());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (few + enough);
        match within(middle) {
            Some(point) => (enough, best) = (middle, point),
            None => few = middle,
        }
    }
    best.as_vec3()
}

/// The nearest point in balls that are `grown` larger, which `from` is not in, if there is one.
///
/// In twice the precision: surfaces that only just meet do so in a lens that is 1 mm wide where it
/// is a micrometre thick.
fn on_surfaces(from: DVec3, balls: &[Ball], grown: f64) -> Option<DVec3> {
    let ball = |at: usize| (balls[at].0.as_dvec3(), f64::from(balls[at].1) + grown);
    let everywhere = |point: DVec3| {
        (0..balls.len()).all(|at| {
            let (centre, radius) = ball(at);
            point.distance_squared(centre) <= (radius + ON).powi(2)
        })
    };
    for at in 0..balls.len() {
        let (centre, radius) = ball(at);
        let point = centre + (from - centre).clamp_length_max(radius);
        // What is nearest in one of them is so in all of them.
        if everywhere(point) {
            return Some(point);
        }
    }
    let (mut best, mut least) = (None, f64::INFINITY);
    let mut look_at = |point: DVec3| {
        let distance = point.distance_squared(from);
        if distance < least && everywhere(point) {
            (best, least) = (Some(point), distance);
        }
    };
    for first in 0..balls.len() {
        for second in 0..first {
            let Some(circle) = Circle::new(ball(first), ball(second)) else { continue };
            circle.nearest(from).into_iter().for_each(&mut look_at);
            for third in 0..second {
                circle.on(ball(third)).into_iter().flatten().for_each(&mut look_at);
            }
        }
    }
    best
}

/// Where the surfaces of two balls meet.
struct Circle {
    centre: DVec3,
    /// Of its plane.
    normal: DVec3,
    radius: f64,
}

impl Circle {
    fn new((a, radius_a): (DVec3, f64), (b, radius_b): (DVec3, f64)) -> Option<Self> {
        let apart = a.distance(b);
        let normal = (b - a).try_normalize()?;
        let along = (apart * apart + radius_a * radius_a - radius_b * radius_b) / (2.0 * apart);
        let squared = radius_a * radius_a - along * along;
        // Surfaces that touch, but for rounding, meet in a point.
        let meet = squared > -2.0 * ON * radius_a;
        meet.then(|| Self { centre: a + normal * along, normal, radius: squared.max(0.0).sqrt() })
    }

    /// Its point nearest to another one; `None` from its axis, where all are as near.
    fn nearest(&self, from: DVec3) -> Option<DVec3> {
        let outward = (from - self.centre).reject_from_normalized(self.normal);
        Some(self.centre + outward.try_normalize()? * self.radius)
    }

    /// Where it goes through the surface of a ball.
    fn on(&self, (centre, radius): (DVec3, f64)) -> Option<[DVec3; 2]> {
        // In the circle's plane the ball is a disc.
        let away = centre - self.centre;
        let height = away.dot(self.normal);
        let disc = radius * radius - height * height;
        let to_disc = away - self.normal * height;
        let apart = to_disc.length();
        let x = to_disc.try_normalize()?;
        let along = (apart * apart + self.radius * self.radius - disc) / (2.0 * apart);
        let squared = self.radius * self.radius - along * along;
        let across = self.normal.cross(x) * squared.max(0.0).sqrt();
        let middle = self.centre + x * along;
        (squared > -2.0 * ON * self.radius).then(|| [middle + across, middle - across])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn between_wants_that_exclude_each_other_they_stay_in_the_middle() {
        let ball = |x: f32| (Vec3::new(x, 0.0, 0.0), 0.5);
        let middle = nearest(Vec3::new(0.0, 0.1, 0.0), &[ball(-1.0), ball(1.0)]);
        assert!(middle.x.abs() < 0.01, "{middle}");
    }

    /// Two balls that part: no jump where they stop to have a point in common.
    #[test]
    fn where_balls_part_nothing_jumps() {
        let from = Vec3::new(0.1, 0.4, 0.0);
        let mut before: Option<Vec3> = None;
        for step in 0..4000 {
            let x = 0.4 + 5e-5 * step as f32;
            let balls = [(Vec3::X * x, 0.5), (Vec3::NEG_X * x, 0.5)];
            let found = nearest(from, &balls);
            // The lens shrinks the faster the smaller it is.
            let moved = before.map_or(0.0, |before| found.distance(before));
            assert!(moved < 0.008, "{x}: {moved}");
            before = Some(found);
        }
    }

    /// Centres at the corners of a triangle: the surfaces meet in two points.
    #[test]
    fn on_three_surfaces() {
        let centres = [Vec3::X, Vec3::Y, Vec3::ZERO].map(|corner| corner * 0.6);
        let balls = centres.map(|centre| (centre, 0.3 * 3f32.sqrt()));
        for z in [3.0, -3.0] {
            let found = nearest(Vec3::new(0.31, 0.3, z), &balls);
            assert!(found.abs_diff_eq(Vec3::new(0.3, 0.3, 0.1 * z), 1e-5), "{found}");
        }
    }

    proptest! {
        /// The nearest point of a convex set is the one from which the way back to where one came
        /// from leads away from all others of the set.
        #[test]
        fn no_place_in_all_balls_is_nearer(
            centres in prop::collection::vec(prop::array::uniform3(-0.5..0.5f32), 1..5),
            from in prop::array::uniform3(-1.5..1.5f32),
            others in prop::collection::vec(prop::array::uniform3(-0.6..0.6f32), 64),
        ) {
            // All of them hold the origin with some room.
            let centres: Vec<_> = centres.into_iter().map(Vec3::from_array).collect();
            let balls: Vec<_> = centres.iter().map(|&c| (c, c.length() + 0.1)).collect();
            let from = Vec3::from_array(from);
            let found = nearest(from, &balls);
            let excess = |p: Vec3| balls.iter().map(|(c, r)| p.distance(*c) - r).fold(-1.0, f32::max);
            prop_assert!(excess(found) < 1e-5, "{}", excess(found));
            for other in others.into_iter().map(Vec3::from_array).filter(|&p| excess(p) <= 0.0) {
                prop_assert!(other.distance(from) > found.distance(from) - 1e-5);
            }
        }

        /// Nothing is less beyond the ball that it is farthest beyond.
        #[test]
        fn where_there_is_none_it_is_least_beyond_them(
            centres in prop::collection::vec(prop::array::uniform3(-2.0..2.0f32), 2..6),
            from in prop::array::uniform3(-1.5..1.5f32),
            others in prop::collection::vec(prop::array::uniform3(-2.0..2.0f32), 64),
        ) {
            let balls: Vec<_> = centres.into_iter().map(|c| (Vec3::from_array(c), 0.3)).collect();
            let found = nearest(Vec3::from_array(from), &balls);
            let excess = |p: Vec3| balls.iter().map(|(c, r)| p.distance(*c) - r).fold(0.0, f32::max);
            for other in others.into_iter().map(Vec3::from_array) {
                prop_assert!(excess(found) < excess(other) + 1e-4, "{}", excess(found));
            }
        }
    }
}
