//! Individuals in the lanes of one register, stepped together.
//!
//! The method is that of Box2D 3 ("soft step": Macklin et al., "Small steps in physics simulation",
//! 2019, with the soft constraints and the relaxing pass of Catto, "Solver2D", 2024): sub-steps of
//! one warm-started solve with soft position correction, after which a second solve without it takes
//! out the speed that the correction added. What differs: bodies touch the ground only, at their
//! corners and at its own; contacts look ahead as far as a point moves in a step; of a joint's two
//! limits the nearer one is held. Lanes may differ in bodies' sizes and in all of [`Physics`] but the
//! ground.

mod contact;
mod parts;
mod sides;
mod solve;
mod terrain;

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Mask, Simd, math};

use self::contact::Corner;
use self::parts::{Hinge, Rigid, Rules};
use self::sides::Sides;
use self::terrain::Terrain;
use crate::physics::DEPTH;
use crate::world::turn;
use crate::{Ground, Outline, Physics, Pose, Stage, WorldError};

/// A part closer to the ground than this touches it, metres: Box2D's margin, so that duty factors
/// mean the same.
const TOUCHING: f32 = 0.02;

/// As many individuals of like bodies as there are lanes.
pub struct Lockstep<S: Simd> {
    simd: S,
    individuals: usize,
    bodies: Vec<Rigid<S>>,
    hinges: Vec<Hinge<S>>,
    corners: Vec<Corner<S>>,
    /// Of each part; none on flat ground.
    sides: Vec<Sides<S>>,
    rules: Rules<S>,
    substeps: u32,
    ground: Terrain,
    flat: bool,
    water: bool,
    ends: Vec<(usize, usize)>,
    /// Angles that the parts have in the start pose, for each lane.
    start_angles: Vec<Lanes<S>>,
    /// Centre of mass of each part in the frame that was upright in the start pose.
    centres: Vec<[Lanes<S>; 2]>,
    /// Where the least distance to the ground is less than what counts as touching.
    touching: Vec<Mask<S>>,
}

impl<S: Simd> Lockstep<S> {
    /// An individual for each lane, in the start pose, lowered until the lowest point touches the
    /// ground; lanes that are left over repeat the last.
    ///
    /// # Errors
    /// Physics out of range.
    ///
    /// # Panics
    /// No individual or more than lanes; bodies whose parts and joints are not the same in number
    /// and order; grounds or sub-steps that differ.
    pub fn new(simd: S, individuals: &[(&Body, &Physics)]) -> Result<Self, WorldError> {
        let count = individuals.len();
        assert!((1..=Lanes::<S>::WIDTH).contains(&count), "an individual a lane");
        let (first, physics) = individuals[0];
        for (body, other) in individuals {
            other.check()?;
            assert!(other.ground == physics.ground, "one ground for all lanes");
            assert!(other.water.is_some() == physics.water.is_some(), "all in water or none");
            assert!(other.substeps == physics.substeps, "one number of sub-steps for all lanes");
            assert!(body.parts().len() == first.parts().len(), "bodies of one kind");
        }
        let who = |lane: usize| individuals[lane.min(count - 1)];
        let lanes = |value: &mut dyn FnMut(&Body, &Physics) -> f32| {
            Lanes::from_fn(simd, |lane| value(who(lane).0, who(lane).1))
        };
        let ground = physics.ground.outline();
        let lift = lanes(&mut |body, _| {
            let [left, bottom, right, _] = body.bounds();
            let depth = if physics.water.is_some() { DEPTH } else { 0.0 };
            ground.highest(left, right) - bottom + depth
        });
        let ends: Vec<_> = (0..first.joints().len()).map(|joint| first.ends(joint)).collect();
        let bodies: Vec<_> =
            (0..first.parts().len()).map(|part| Rigid::new(simd, part, &who, lift)).collect();
        let hinges = (0..first.joints().len())
            .map(|joint| Hinge::new(joint, ends[joint], &who, lift, &bodies))
            .collect();
        let start_angles = (0..first.parts().len())
            .map(|part| lanes(&mut |body, _| body.parts()[part].angle))
            .collect();
        let centres = (0..first.parts().len())
            .map(|part| {
                let axis = |axis: usize| {
                    lanes(&mut |body, _| {
                        let part = &body.parts()[part];
                        turn(part.shape.centre(), part.angle)[axis]
                    })
                };
                [axis(0), axis(1)]
            })
            .collect();
        let flat = physics.ground == Ground::Flat;
        let mut sides: Vec<Sides<S>> = Vec::new();
        for part in 0..if flat { 0 } else { bodies.len() } {
            let first = sides.last().map_or(0, |before| before.lying.end);
            sides.push(Sides::new(simd, part, first, &who));
        }
        let mut made = Self {
            simd,
            individuals: count,
            touching: vec![Mask::never(simd); bodies.len()],
            corners: Corner::all(simd, &who, &sides),
            sides,
            rules: Rules::new(simd, &who),
            bodies,
            hinges,
            substeps: physics.substeps,
            ground: Terrain::new(ground),
            flat,
            water: physics.water.is_some(),
            ends,
            start_angles,
            centres,
        };
        made.look();
        // Nothing was touched before anything moved.
        made.touching.fill(Mask::never(simd));
        Ok(made)
    }

    /// Individuals, without the lanes that are left over.
    pub fn individuals(&self) -> usize {
        self.individuals
    }

    /// The instructions that it runs on.
    pub fn simd(&self) -> S {
        self.simd
    }

    /// Where a part's frame is.
    pub fn pose(&self, lane: usize, part: usize) -> Pose {
        let body = &self.bodies[part];
        let [cx, cy] = self.centres[part];
        let x = body.x - (body.cos * cx - body.sin * cy);
        let y = body.y - (body.sin * cx + body.cos * cy);
        let angle = math::wrap(body.angle + self.start_angles[part]);
        Pose { x: x.lane(lane), y: y.lane(lane), angle: angle.lane(lane) }
    }

    /// Fingerprint of where an individual's parts are and how fast, to the last bit: 64 bits of
    /// FNV-1a, continued from `hash`. Start with 0.
    pub fn hash(&self, lane: usize, hash: u64) -> u64 {
        let numbers = self.bodies.iter().flat_map(|body| {
            [body.x, body.y, body.angle, body.cos, body.sin, body.vx, body.vy, body.w]
        });
        numbers.fold(hash ^ 0xcbf2_9ce4_8422_2325, |hash, number| {
            (hash ^ u64::from(number.lane(lane).to_bits())).wrapping_mul(0x0100_0000_01b3)
        })
    }

    /// Kinetic and potential energy of an individual, joules; heights from 0.
    pub fn energy(&self, lane: usize) -> f64 {
        let gravity = f64::from(self.rules.gravity.lane(lane));
        let energy = |body: &Rigid<S>| {
            let of = |value: Lanes<S>| f64::from(value.lane(lane));
            let (mass, inertia) = (1.0 / of(body.inverse_mass), 1.0 / of(body.inverse_inertia));
            let speed = of(body.vx).powi(2) + of(body.vy).powi(2);
            0.5 * mass * speed + 0.5 * inertia * of(body.w).powi(2) + mass * gravity * of(body.y)
        };
        self.bodies.iter().map(energy).sum()
    }

    /// Work that the motors did in the last step, joules.
    pub fn motor_work(&self, lane: usize) -> f64 {
        self.hinges.iter().map(|hinge| f64::from(hinge.work.lane(lane))).sum()
    }

    /// The widest gap between the two sides of any joint, metres.
    pub fn widest_gap(&self, lane: usize) -> f32 {
        let gap = |hinge: &Hinge<S>| {
            let [x, y] = hinge.gap(&self.bodies);
            (x * x + y * y).sqrt().lane(lane)
        };
        self.hinges.iter().map(gap).fold(0.0, f32::max)
    }

    /// How deep any corner is in the ground, or one of the ground in a part, metres.
    pub fn deepest(&self, lane: usize) -> f32 {
        let depth = self.corners.iter().map(|corner| -corner.least().lane(lane));
        depth.fold(0.0, f32::max)
    }

    /// Everything sideways as seen from the ground's start, metres a second of each part: for tests
    /// that throw and let slide.
    pub fn throw(&mut self, part: usize, velocity: [Lanes<S>; 2], turning: Lanes<S>) {
        let body = &mut self.bodies[part];
        (body.vx, body.vy, body.w) = (velocity[0], velocity[1], turning);
    }
}

impl<S: Simd> Stage<S> for Lockstep<S> {
    #[inline(always)]
    fn groups(&self) -> usize {
        1
    }

    #[inline(always)]
    fn dt(&self) -> Lanes<S> {
        self.rules.dt
    }

    fn ground(&self) -> &Outline {
        &self.ground.outline
    }

    #[inline(always)]
    fn set_motor(&mut self, _: usize, joint: usize, speed: Lanes<S>) -> Result<(), WorldError> {
        self.hinges[joint].speed = speed;
        Ok(())
    }

    #[inline(always)]
    fn step(&mut self) -> Result<(), WorldError> {
        if self.flat {
            self.advance::<true>();
        } else {
            self.advance::<false>();
        }
        Ok(())
    }

    #[inline(always)]
    fn centre(&self, _: usize, part: usize) -> [Lanes<S>; 2] {
        [self.bodies[part].x, self.bodies[part].y]
    }

    #[inline(always)]
    fn turned(&self, _: usize, part: usize) -> Lanes<S> {
        math::wrap(self.bodies[part].angle)
    }

    #[inline(always)]
    fn joint_angle(&self, _: usize, joint: usize) -> Lanes<S> {
        let (parent, child) = self.ends[joint];
        math::wrap(self.bodies[child].angle - self.bodies[parent].angle)
    }

    #[inline(always)]
    fn touches(&self, _: usize, part: usize) -> Mask<S> {
        self.touching[part]
    }

    #[inline(always)]
    fn motor_torque(&mut self, _: usize, joint: usize) -> Result<Lanes<S>, WorldError> {
        Ok(self.hinges[joint].torque)
    }

    fn push(&mut self, _: usize, part: usize, change: [Lanes<S>; 2]) -> Result<(), WorldError> {
        let body = &mut self.bodies[part];
        body.vx += change[0];
        body.vy += change[1];
        Ok(())
    }

    fn pose(&self, _: usize, lane: usize, part: usize) -> Pose {
        Lockstep::pose(self, lane, part)
    }

    fn hash(&self, _: usize, lane: usize, hash: u64) -> u64 {
        Lockstep::hash(self, lane, hash)
    }
}
