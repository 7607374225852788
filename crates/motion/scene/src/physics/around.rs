//! A scene as a character meets it.

use ambulo_control::Wall;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};

use super::{Physics, Refused, Upright, What, level};
use crate::parts::Solid;
use crate::surroundings::{Deed, Surroundings};

/// A walker steps over what ends below the first and under what begins above the second, metres over
/// the ground.
const IN_THE_WAY: [f32; 2] = [0.25, 1.75];
/// Half of a side below which a footprint is a line, metres.
const THIN: f32 = 0.06;

impl Surroundings for Physics {
    fn terrain(&self) -> &dyn Terrain {
        &self.ground
    }

    fn walls(
        &self,
        place: Vec2,
        within: f32,
        keep: f32,
        nearer: Option<(usize, f32)>,
        out: &mut Vec<Wall>,
    ) {
        let near = |wall: &Wall| {
            let room = Wall { width: within + wall.width, ..*wall };
            room.push_out(place) != place
        };
        let walls = self.walls.iter().map(|&Upright { start, end, half, .. }| Wall {
            start,
            end,
            width: keep + half,
        });
        out.extend(walls.filter(near));
        for (index, thing) in self.things.iter().enumerate() {
            let far = level(thing.bodies[0].now.translation).distance(place) > within + 6.0;
            if !far {
                let own = nearer.filter(|&(object, _)| object == index);
                let keep = own.map_or(keep, |(_, own)| own);
                out.extend(self.sides(index, place, keep).filter(near));
            }
        }
    }

    fn distance(&self, object: usize, place: Vec2) -> f32 {
        let from = |wall: Wall| {
            let along = wall.end - wall.start;
            let t = (place - wall.start).dot(along) / along.length_squared().max(1e-12);
            let nearest = wall.start + along * t.clamp(0.0, 1.0);
            place.distance(nearest) - wall.width
        };
        self.sides(object, place, 0.0).map(from).fold(f32::MAX, f32::min)
    }

    fn way_out(&self, point: Vec3, but: Option<usize>) -> Option<Vec3> {
        self.solid_at(point, but).map(|(_, out)| out)
    }

    fn turned(&self, object: usize) -> f32 {
        self.joint(object).unwrap_or(0.0)
    }

    fn frame(&self, object: usize, name: &str) -> Option<Transform> {
        Physics::frame(self, object, name)
    }

    fn act(&mut self, object: usize, deed: Deed) -> Result<(), Refused> {
        match deed {
            Deed::Drive { to, most } => self.drive(object, to, most),
            Deed::Press { depth, most } => self.press(object, depth, most),
            Deed::Release => self.release(object),
            Deed::Push(push) => self.push(object, push),
            Deed::Attach(holder) => self.attach(object, holder),
            Deed::Carry(holder) => self.carry(object, holder),
            Deed::Detach => self.detach(object),
        }
    }

    fn ease(&self, object: usize, force: f32) -> f32 {
        // What is no box has no friction that slows anybody.
        Physics::ease(self, object, force).unwrap_or(1.0)
    }

    fn character_at(&mut self, feet: Vec3) {
        // Refused only where there is no character; then nothing can sweep through it.
        let _ = self.move_character(feet);
    }
}

impl Physics {
    /// What a point is deepest in, but for the object `but`, and its shortest way out, metres.
    pub fn solid_at(&self, point: Vec3, but: Option<usize>) -> Option<(What, Vec3)> {
        let things = self.things.iter().enumerate().filter(|&(object, _)| Some(object) != but);
        let objects = things.flat_map(|(object, thing)| {
            thing.parts.iter().enumerate().filter_map(move |(part, shape)| {
                let at = self.part(object, part)?;
                let own = at.inverse().transform_point(point);
                let out = shape.solids.iter().filter_map(|solid| out_of(solid, own));
                let out = out.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
                Some((What::Object { object, part }, at.rotation * out))
            })
        });
        let walls = self
            .walls
            .iter()
            .enumerate()
            .filter_map(|(index, wall)| Some((What::Wall { index }, wall.out(point)?)));
        objects.chain(walls).max_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()))
    }

    /// The sides of what an object has in a walker's way, for somebody who stands at a place.
    fn sides(&self, object: usize, place: Vec2, keep: f32) -> impl Iterator<Item = Wall> + '_ {
        let floor = self.ground.height(place.x, place.y);
        let thing = self.things.get(object).filter(|thing| thing.held.is_none());
        let parts = thing.into_iter().flat_map(|thing| thing.parts.iter().enumerate());
        let solids = parts.flat_map(move |(part, shape)| {
            let at = self.part(object, part);
            shape.solids.iter().filter_map(move |solid| Some((at?, solid)))
        });
        solids.flat_map(move |(at, solid)| {
            let print = footprint(at, solid.centre, solid.half);
            let [low, high] = print.heights.map(|height| height - floor);
            let blocks = high > IN_THE_WAY[0] && low < IN_THE_WAY[1];
            print.sides(keep).into_iter().flatten().filter(move |_| blocks)
        })
    }
}

/// The shortest way out of a box for a point in its frame.
fn out_of(solid: &Solid, point: Vec3) -> Option<Vec3> {
    let off = point - solid.centre;
    let left = solid.half - off.abs();
    if left.min_element() <= 0.0 {
        return None;
    }
    let axis = left.min_position();
    let mut out = Vec3::ZERO;
    out[axis] = left[axis].copysign(off[axis]);
    Some(out)
}

impl Upright {
    /// The shortest way out of it for a point in it.
    fn out(&self, point: Vec3) -> Option<Vec3> {
        let way = (self.end - self.start).normalize_or(Vec2::X);
        let off = level(point) - self.start;
        let across = off.dot(way.perp());
        let (along, length) = (off.dot(way), self.start.distance(self.end));
        let inside = across.abs() < self.half && (0.0..length).contains(&along);
        let out = way.perp() * (self.half - across.abs()).copysign(across);
        (inside && point.y < self.top).then(|| Vec3::new(out.x, 0.0, out.y))
    }
}

/// What a box covers of the ground plane.
struct Footprint {
    middle: Vec2,
    /// Unit vector of its length, and half of length and width, the length the greater.
    along: Vec2,
    half: Vec2,
    /// Lowest and highest point.
    heights: [f32; 2],
}

/// A box in the frame of its part, which is `at`; it may be tilted.
fn footprint(at: Transform, centre: Vec3, half: Vec3) -> Footprint {
    let middle = at.transform_point(centre);
    let axes = [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z].map(|v| at.rotation * v);
    let longest = axes
        .iter()
        .map(|&axis| level(axis))
        .fold(Vec2::ZERO, |a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let along = longest.normalize_or(Vec2::X);
    let reach = |way: Vec2| axes.iter().map(|&axis| level(axis).dot(way).abs()).sum::<f32>();
    let up: f32 = axes.iter().map(|axis| axis.y.abs()).sum();
    let half = Vec2::new(reach(along), reach(along.perp()));
    Footprint { middle: level(middle), along, half, heights: [middle.y - up, middle.y + up] }
}

impl Footprint {
    /// The segments to keep `keep` metres from: the middle line of what is thin, else four sides.
    fn sides(&self, keep: f32) -> [Option<Wall>; 4] {
        let [long, wide] = [self.along * self.half.x, self.along.perp() * self.half.y];
        if self.half.y < THIN {
            let long = self.along * (self.half.x - self.half.y).max(0.0);
            let [start, end] = [self.middle - long, self.middle + long];
            return [Some(Wall { start, end, width: keep + self.half.y }), None, None, None];
        }
        let corner = |a: f32, b: f32| self.middle + long * a + wide * b;
        let side = |start, end| Some(Wall { start, end, width: keep });
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        [0, 1, 2, 3].map(|at| side(corners[at], corners[(at + 1) % 4]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::glam::Quat;

    #[test]
    fn a_turned_box_covers_what_it_stands_on() {
        let at = Transform::new(Vec3::new(2.0, 0.5, 1.0), Quat::from_rotation_y(0.5));
        let print = footprint(at, Vec3::ZERO, Vec3::new(0.2, 0.5, 0.8));
        assert!(print.middle.abs_diff_eq(Vec2::new(2.0, 1.0), 1e-6));
        assert!((print.half - Vec2::new(0.8, 0.2)).length() < 1e-5, "{}", print.half);
        // A yaw turns +Z towards +X.
        let along = Vec2::new(0.5f32.sin(), 0.5f32.cos());
        assert!(print.along.dot(along).abs() > 0.9999);
        assert!(print.heights[0].abs() < 1e-6 && (print.heights[1] - 1.0).abs() < 1e-6);
        let sides = print.sides(0.3);
        assert!(sides.iter().flatten().all(|wall| wall.width == 0.3));
        // Outside of it at 0.2 m, somebody is moved to 0.3 m.
        let off = print.middle + along.perp() * 0.4;
        let out = sides.iter().flatten().fold(off, |at, wall| wall.push_out(at));
        assert!(((out - print.middle).dot(along.perp()).abs() - 0.5).abs() < 1e-5);
    }

    #[test]
    fn a_leaf_is_a_line() {
        let print = footprint(Transform::IDENTITY, Vec3::Y, Vec3::new(0.45, 1.0, 0.02));
        let [Some(wall), None, None, None] = print.sides(0.2) else { panic!("one line") };
        assert!((wall.width - 0.22).abs() < 1e-6 && (wall.start.x.abs() - 0.43).abs() < 1e-6);
    }
}
