//! What objects are made of: parts, their boxes, and the frames that interactions hang on.

use std::f32::consts::{FRAC_PI_2, PI};

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec3};

use crate::object::{Button, Chair, Door, Kind, Lever, MovableBox, Side, yawed};

/// A rigid part of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its name; that of the frame that moves with it, if there is one.
    pub name: &'static str,
    /// Its frame in the object's, at rest. Of a hinged part it lies on the hinge.
    pub rest: Transform,
    /// What it consists of.
    pub solids: Vec<Solid>,
    /// How it moves.
    pub motion: Motion,
}

/// A box in the frame of its part, its sides along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Metres.
    pub centre: Vec3,
    /// Half its extents, metres.
    pub half: Vec3,
}

/// How a part moves against its object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// Wherever it is pushed or carried.
    Loose {
        /// Kilograms.
        mass: f32,
        /// Coulomb friction.
        friction: f32,
    },
    /// About an axis through the origin of its frame.
    Hinge {
        /// Unit vector.
        axis: Vec3,
        /// Least and greatest angle, radians.
        limits: [f32; 2],
        /// N·m·s/rad.
        damping: f32,
        /// Of a spring that turns it back to 0 when nothing drives it, N·m/rad; 0: none.
        closer: f32,
        /// Kilograms.
        mass: f32,
    },
    /// Along an axis; a spring holds it at 0.
    Slide {
        /// Unit vector.
        axis: Vec3,
        /// Least and greatest way, metres.
        limits: [f32; 2],
        /// N/m.
        stiffness: f32,
        /// Kilograms.
        mass: f32,
    },
}

/// A frame that points of an interaction lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The part that it moves with; `None`: the object's place.
    pub part: Option<usize>,
    /// Where it is in the part. A frame on a surface has +Z out of it, towards who uses it.
    pub at: Transform,
}

fn solid(centre: [f32; 3], size: [f32; 3]) -> Solid {
    Solid { centre: centre.into(), half: Vec3::from(size) * 0.5 }
}

fn part(name: &'static str, rest: Vec3, solids: Vec<Solid>, motion: Motion) -> Part {
    Part { name, rest: Transform::new(rest, Quat::IDENTITY), solids, motion }
}

impl Part {
    /// Moment of inertia of a hinged part about its hinge, kg·m²: of its boxes, m/12 (a² + b²) + m d².
    /// 1 for every other part.
    pub fn inertia(&self) -> f32 {
        let Motion::Hinge { axis, mass, .. } = self.motion else { return 1.0 };
        let share = mass / self.solids.len() as f32;
        let across = |v: Vec3| v.length_squared() - v.dot(axis) * v.dot(axis);
        self.solids.iter().map(|s| share * (across(s.half) / 3.0 + across(s.centre))).sum()
    }
}

impl Kind {
    /// Its parts; one that moves comes after what it hangs on.
    pub fn parts(&self) -> Vec<Part> {
        match self {
            Kind::Door(door) => door.parts(),
            Kind::Chair(chair) => chair.parts(),
            Kind::Box(shape) => shape.parts(),
            Kind::Button(button) => button.parts(),
            Kind::Lever(lever) => lever.parts(),
        }
    }

    /// The frame of a name; `None` if this kind has no such frame.
    pub fn frame(&self, name: &str) -> Option<Frame> {
        if name == "object" {
            return Some(Frame { part: None, at: Transform::IDENTITY });
        }
        let (part, place, rotation) = match self {
            Kind::Door(door) => door.frame(name),
            Kind::Chair(chair) => chair.frame(name),
            Kind::Box(shape) => shape.frame(name),
            Kind::Button(button) => button.frame(name),
            Kind::Lever(lever) => lever.frame(name),
        }?;
        Some(Frame { part: Some(part), at: Transform::new(place, rotation) })
    }

    /// The frame of a name in the object's, while the object rests.
    pub fn frame_at_rest(&self, name: &str) -> Option<Transform> {
        let frame = self.frame(name)?;
        let rest = frame.part.map_or(Transform::IDENTITY, |part| self.parts()[part].rest);
        Some(rest * frame.at)
    }
}

type Place = Option<(usize, Vec3, Quat)>;

impl Door {
    /// Gap between the leaf and the ground, metres.
    const GAP: f32 = 0.01;
    /// From the free edge of the leaf to its handles, and from the leaf to a hand on them, metres.
    const INSET: f32 = 0.07;

    /// +1 if the hinge is on the left, +X.
    fn side(&self) -> f32 {
        if self.hinge == Side::Left { 1.0 } else { -1.0 }
    }

    fn parts(&self) -> Vec<Part> {
        let &Door { width, height, thickness, frame, .. } = self;
        let (side, deep) = (self.side(), thickness.max(0.08));
        let post = |x: f32| solid([x, height * 0.5, 0.0], [frame, height, deep]);
        let off = (width + frame) * 0.5;
        let lintel = [0.0, height + frame * 0.5, 0.0];
        let lintel = solid(lintel, [width + 2.0 * frame, frame, deep]);
        let tall = height - Self::GAP;
        let leaf = [-side * width * 0.5, Self::GAP + tall * 0.5, 0.0];
        let leaf = solid(leaf, [width, tall, thickness]);
        let (limits, damping, mass, closer) = (self.limits, self.damping, self.mass, self.closer);
        let hinge = Motion::Hinge { axis: Vec3::Y * side, limits, damping, closer, mass };
        vec![
            part("frame", Vec3::ZERO, vec![post(-off), post(off), lintel], Motion::Fixed),
            part("leaf", Vec3::X * side * width * 0.5, vec![leaf], hinge),
        ]
    }

    fn frame(&self, name: &str) -> Place {
        let x = -self.side() * (self.width - Self::INSET);
        let z = self.thickness * 0.5 + Self::INSET;
        match name {
            "leaf" => Some((1, Vec3::ZERO, Quat::IDENTITY)),
            "handle_front" => Some((1, Vec3::new(x, self.handle_height, z), Quat::IDENTITY)),
            "handle_back" => Some((1, Vec3::new(x, self.handle_height, -z), yawed(PI))),
            _ => None,
        }
    }
}

impl Chair {
    /// Of the seat and the back rest, metres.
    const THICKNESS: f32 = 0.04;

    /// The seat's middle is over the object's place.
    fn parts(&self) -> Vec<Part> {
        let &Chair { seat_height, seat_depth, width, back_height } = self;
        let (thick, leg) = (Self::THICKNESS, Self::THICKNESS);
        let under = seat_height - thick;
        let mut solids =
            vec![solid([0.0, seat_height - thick * 0.5, 0.0], [width, thick, seat_depth])];
        let (x, z) = ((width - leg) * 0.5, (seat_depth - leg) * 0.5);
        for (x, z) in [(-x, -z), (x, -z), (-x, z), (x, z)] {
            solids.push(solid([x, under * 0.5, z], [leg, under, leg]));
        }
        if back_height > seat_height {
            let (tall, back) = (back_height - seat_height, -(seat_depth + thick) * 0.5);
            solids.push(solid([0.0, seat_height + tall * 0.5, back], [width, tall, thick]));
        }
        vec![part("chair", Vec3::ZERO, solids, Motion::Fixed)]
    }

    fn frame(&self, name: &str) -> Place {
        let place = match name {
            "seat" => Vec3::Y * self.seat_height,
            "back" => {
                Vec3::new(0.0, self.back_height.max(self.seat_height), -self.seat_depth * 0.5)
            }
            _ => return None,
        };
        Some((0, place, Quat::IDENTITY))
    }
}

impl MovableBox {
    fn parts(&self) -> Vec<Part> {
        let motion = Motion::Loose { mass: self.mass, friction: self.friction };
        let rest = Vec3::Y * self.size[1] * 0.5;
        vec![part("box", rest, vec![solid([0.0; 3], self.size)], motion)]
    }

    fn frame(&self, name: &str) -> Place {
        let half = Vec3::from(self.size) * 0.5;
        let (place, rotation) = match name {
            "box" => (Vec3::ZERO, Quat::IDENTITY),
            "front" => (Vec3::Z * half.z, Quat::IDENTITY),
            "back" => (Vec3::NEG_Z * half.z, yawed(PI)),
            "left" => (Vec3::X * half.x, yawed(FRAC_PI_2)),
            "right" => (Vec3::NEG_X * half.x, yawed(-FRAC_PI_2)),
            "top" => (Vec3::Y * half.y, Quat::IDENTITY),
            _ => return None,
        };
        Some((0, place, rotation))
    }
}

impl Button {
    /// How far the cap stands out when it is all the way in, metres.
    const STANDS_OUT: f32 = 0.01;
    /// Kilograms.
    const MASS: f32 = 0.1;

    fn parts(&self) -> Vec<Part> {
        let &Button { height, radius, travel, stiffness } = self;
        let (wide, tall) = (2.0 * radius + 0.04, height + radius + 0.02);
        let post = solid([0.0, tall * 0.5, -0.05], [wide, tall, 0.1]);
        let deep = Self::STANDS_OUT + travel;
        let cap = solid([0.0, 0.0, deep * 0.5], [2.0 * radius, 2.0 * radius, deep]);
        let motion =
            Motion::Slide { axis: Vec3::NEG_Z, limits: [0.0, travel], stiffness, mass: Self::MASS };
        vec![
            part("post", Vec3::ZERO, vec![post], Motion::Fixed),
            part("cap", Vec3::Y * height, vec![cap], motion),
        ]
    }

    fn frame(&self, name: &str) -> Place {
        let out = match name {
            "cap" => 0.0,
            "face" => Self::STANDS_OUT + self.travel,
            _ => return None,
        };
        Some((1, Vec3::Z * out, Quat::IDENTITY))
    }
}

impl Lever {
    /// Kilograms.
    const MASS: f32 = 2.0;

    fn parts(&self) -> Vec<Part> {
        let &Lever { height, length, limits, damping, closer } = self;
        let post = solid([0.0, height * 0.5, 0.0], [0.1, height, 0.1]);
        let arm = solid([0.0, length * 0.5, 0.0], [0.03, length, 0.03]);
        let (axis, mass) = (Vec3::X, Self::MASS);
        let motion = Motion::Hinge { axis, limits, damping, closer, mass };
        vec![
            part("post", Vec3::ZERO, vec![post], Motion::Fixed),
            part("arm", Vec3::Y * height, vec![arm], motion),
        ]
    }

    fn frame(&self, name: &str) -> Place {
        let up = match name {
            "arm" => 0.0,
            "grip" => self.length,
            _ => return None,
        };
        Some((1, Vec3::Y * up, Quat::IDENTITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door(hinge: Side) -> Kind {
        let (limits, mass, damping) = ([-1.5, 1.5], 20.0, 2.0);
        let (width, height, thickness, frame) = (0.9, 2.0, 0.04, 0.08);
        let handle_height = 1.0;
        Kind::Door(Door {
            width,
            height,
            thickness,
            frame,
            handle_height,
            hinge,
            limits,
            mass,
            damping,
            closer: 0.0,
        })
    }

    /// Whichever side the hinge is on: a positive angle brings the handle to the front.
    #[test]
    fn a_positive_angle_opens_to_the_front() {
        for (side, free_edge) in [(Side::Left, -1.0), (Side::Right, 1.0)] {
            let door = door(side);
            let handle = door.frame_at_rest("handle_front").unwrap().translation;
            assert!(handle.x * free_edge > 0.3 && handle.z > 0.0, "{handle}");
            let leaf = &door.parts()[1];
            let Motion::Hinge { axis, .. } = leaf.motion else { panic!("a leaf has a hinge") };
            let opened = leaf.rest * Transform::new(Vec3::ZERO, Quat::from_axis_angle(axis, 1.0));
            let at = door.frame("handle_front").unwrap().at.translation;
            assert!(opened.transform_point(at).z > 0.5);
        }
    }

    #[test]
    fn surfaces_look_out() {
        let shape = MovableBox { size: [1.0, 0.6, 2.0], mass: 1.0, friction: 0.5 };
        let shape = Kind::Box(shape);
        for name in ["front", "back", "left", "right"] {
            let frame = shape.frame_at_rest(name).unwrap();
            let (out, at) = (frame.rotation * Vec3::Z, frame.translation - Vec3::Y * 0.3);
            assert!(out.dot(at) > 0.49 && (out.dot(at) - at.length()).abs() < 1e-6, "{name}");
        }
        assert!(shape.frame_at_rest("left").unwrap().translation.x > 0.0);
        let back = door(Side::Left).frame_at_rest("handle_back").unwrap();
        assert!((back.rotation * Vec3::Z).z < -0.99 && back.translation.z < 0.0);
    }

    #[test]
    fn every_frame_that_is_named_is_there() {
        let button = Button { height: 1.1, radius: 0.05, travel: 0.02, stiffness: 400.0 };
        let (limits, damping, closer) = ([-0.7, 0.7], 2.0, 0.0);
        let lever = Lever { height: 0.9, length: 0.4, limits, damping, closer };
        let chair = Chair { seat_height: 0.45, seat_depth: 0.4, width: 0.4, back_height: 0.0 };
        let shape = MovableBox { size: [0.5; 3], mass: 10.0, friction: 0.5 };
        let kinds = [
            door(Side::Left),
            Kind::Button(button),
            Kind::Lever(lever),
            Kind::Chair(chair),
            Kind::Box(shape),
        ];
        for kind in kinds {
            for name in kind.kind().frames() {
                assert!(kind.frame_at_rest(name).unwrap().is_finite(), "{name}");
            }
            assert_eq!(kind.frame("nose"), None);
        }
    }
}
