//! Bodies, joints and laws, laid out in lanes.

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Simd};

use crate::Physics;
use crate::world::turn;

/// Stiffness, hertz, and damping ratio of joints: Box2D's. Of stiffer ones (120, 1) four times as much
/// of an impact comes back; wide gaps are closed after the step.
const JOINT: [f32; 2] = [60.0, 2.0];
/// The same of the ground: twice Box2D's stiffness, as nothing lies on anything that lies on it.
const CONTACT: [f32; 2] = [120.0, 10.0];
/// The fastest turn, radians a step: Box2D's.
const FASTEST: f32 = 0.25 * std::f32::consts::PI;

/// Who lives in a lane.
pub type Who<'a> = dyn Fn(usize) -> (&'a Body, &'a Physics) + 'a;

/// A rigid part; places of its centre of mass.
#[derive(Clone, Copy, Debug)]
pub struct Rigid<S: Simd> {
    pub x: Lanes<S>,
    pub y: Lanes<S>,
    /// How far it has turned from the start pose, radians, never wrapped; and its cosine and sine.
    pub angle: Lanes<S>,
    pub cos: Lanes<S>,
    pub sin: Lanes<S>,
    pub vx: Lanes<S>,
    pub vy: Lanes<S>,
    pub w: Lanes<S>,
    /// How far it has moved since the step began: small numbers keep their digits.
    pub dx: Lanes<S>,
    pub dy: Lanes<S>,
    pub inverse_mass: Lanes<S>,
    pub inverse_inertia: Lanes<S>,
    /// Cosine and sine of its frame in the start pose, and how much water slows it along the frame's
    /// axes and in turning.
    frame: [Lanes<S>; 2],
    drag: [Lanes<S>; 3],
}

impl<S: Simd> Rigid<S> {
    pub fn new(simd: S, part: usize, who: &Who<'_>, lift: Lanes<S>) -> Self {
        let lanes = |value: &dyn Fn(&Body, &Physics) -> f32| {
            Lanes::from_fn(simd, |lane| value(who(lane).0, who(lane).1))
        };
        let centre = |body: &Body, axis: usize| {
            let part = &body.parts()[part];
            part.position[axis] + turn(part.shape.centre(), part.angle)[axis]
        };
        let (zero, one) = (Lanes::zero(simd), Lanes::splat(simd, 1.0));
        Self {
            x: lanes(&|body, _| centre(body, 0)),
            y: lanes(&|body, _| centre(body, 1)) + lift,
            angle: zero,
            cos: one,
            sin: zero,
            vx: zero,
            vy: zero,
            w: zero,
            dx: zero,
            dy: zero,
            inverse_mass: lanes(&|body, physics| 1.0 / (body.part_mass(part) * physics.mass_scale)),
            inverse_inertia: lanes(&|body, physics| {
                let part = &body.parts()[part];
                1.0 / (part.density * physics.mass_scale * part.shape.second_moment())
            }),
            frame: [0, 1]
                .map(|axis| lanes(&|body, _| turn([1.0, 0.0], body.parts()[part].angle)[axis])),
            drag: [0, 1, 2].map(|way| {
                lanes(&|body, physics| physics.drag(body.parts()[part].shape.extent())[way])
            }),
        }
    }

    /// A vector of the start pose, turned with the part.
    #[inline(always)]
    pub fn turned(&self, [x, y]: [Lanes<S>; 2]) -> [Lanes<S>; 2] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y]
    }

    /// The same back.
    #[inline(always)]
    pub fn unturned(&self, [x, y]: [Lanes<S>; 2]) -> [Lanes<S>; 2] {
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x]
    }

    /// Slows it as water does in a step: implicitly, so that it never turns back.
    #[inline(always)]
    pub fn wade(&mut self) {
        let [c, s] = self.turned(self.frame);
        let along = c * self.vx + s * self.vy;
        let across = c * self.vy - s * self.vx;
        let one = c.like(1.0);
        let along = along / (one + self.drag[0] * along.abs() * self.inverse_mass);
        let across = across / (one + self.drag[1] * across.abs() * self.inverse_mass);
        self.vx = c * along - s * across;
        self.vy = s * along + c * across;
        self.w = self.w / (one + self.drag[2] * self.w.abs() * self.inverse_inertia);
    }

    /// Moves and turns as an impulse at `arm` from the centre would in a unit of time, by little.
    #[inline(always)]
    pub fn shift(&mut self, [px, py]: [Lanes<S>; 2], [rx, ry]: [Lanes<S>; 2]) {
        self.dx += self.inverse_mass * px;
        self.dy += self.inverse_mass * py;
        let turn = self.inverse_inertia * (rx * py - ry * px);
        self.angle += turn;
        // What does not turn keeps its bits; lengths are mended in the next sub-step.
        let (c, s) = (self.cos, self.sin);
        self.cos = c - turn * (s + turn * c * 0.5);
        self.sin = s + turn * (c - turn * s * 0.5);
    }

    /// Moves on by a sub-step of `h` seconds.
    #[inline(always)]
    pub fn advance(&mut self, h: Lanes<S>, fastest: Lanes<S>) {
        self.w = self.w.clamp(-fastest, fastest);
        self.dx += h * self.vx;
        self.dy += h * self.vy;
        let turn = h * self.w;
        self.angle += turn;
        // Series of sine and cosine: a sub-step turns by a fifth of a radian at most.
        let square = turn * turn;
        let sin = turn * ((square * (1.0 / 120.0) - 1.0 / 6.0) * square + 1.0);
        let cos = (square * (1.0 / 24.0) - 0.5) * square + 1.0;
        let (c, s) = (self.cos * cos - self.sin * sin, self.sin * cos + self.cos * sin);
        // One step of Newton's towards length 1.
        let scale = -((c * c + s * s) * 0.5 - 1.5);
        (self.cos, self.sin) = (c * scale, s * scale);
    }
}

/// How softly a constraint is held: of its error a part is corrected, and a part of the impulse that
/// was given is taken back (Catto, "Soft constraints", 2011).
#[derive(Clone, Copy, Debug)]
pub struct Softness<S: Simd> {
    pub rate: Lanes<S>,
    pub mass: Lanes<S>,
    pub impulse: Lanes<S>,
}

impl<S: Simd> Softness<S> {
    /// `limit`: the most hertz as a part of the sub-steps a second.
    fn new([hertz, damping]: [f32; 2], limit: f32, h: Lanes<S>) -> Self {
        let one = h.like(1.0);
        let omega = h.like(hertz).min(one / h * limit) * std::f32::consts::TAU;
        let a = h * omega + 2.0 * damping;
        let b = h * omega * a;
        let rest = one / (b + 1.0);
        Self { rate: omega / a, mass: b * rest, impulse: rest }
    }
}

/// What holds for a whole lane.
#[derive(Clone, Copy, Debug)]
pub struct Rules<S: Simd> {
    /// Seconds of a step and of a sub-step, and how many of the latter a second.
    pub dt: Lanes<S>,
    pub h: Lanes<S>,
    pub per_h: Lanes<S>,
    pub gravity: Lanes<S>,
    /// Radians a second.
    pub fastest: Lanes<S>,
    pub joint: Softness<S>,
    pub contact: Softness<S>,
}

impl<S: Simd> Rules<S> {
    pub fn new(simd: S, who: &Who<'_>) -> Self {
        let dt = Lanes::from_fn(simd, |lane| who(lane).1.dt());
        let h = Lanes::from_fn(simd, |lane| who(lane).1.dt() / who(lane).1.substeps as f32);
        Self {
            dt,
            h,
            per_h: h.like(1.0) / h,
            gravity: Lanes::from_fn(simd, |lane| who(lane).1.weight()),
            fastest: h.like(FASTEST) / dt,
            joint: Softness::new(JOINT, 0.25, h),
            contact: Softness::new(CONTACT, 0.5, h),
        }
    }
}

/// A joint.
#[derive(Clone, Copy, Debug)]
pub struct Hinge<S: Simd> {
    pub parent: usize,
    pub child: usize,
    /// From each side's centre of mass to the hinge, in the start pose and as it is turned now.
    pub local: [[Lanes<S>; 2]; 2],
    pub arm: [[Lanes<S>; 2]; 2],
    /// Between the centres of mass when the step began.
    pub between: [Lanes<S>; 2],
    /// Inverse of what an impulse at the hinge changes: xx, xy, yy.
    pub mass: [Lanes<S>; 3],
    /// The same for turning.
    pub axial: Lanes<S>,
    pub limits: [Lanes<S>; 2],
    /// The nearer limit, 1 for the lower one and −1 for the upper one, and 0 where neither is near.
    pub side: Lanes<S>,
    pub limit: Lanes<S>,
    /// Whether any lane is near a limit.
    pub limited: bool,
    /// What its motor shall do, radians a second, and the most it gives, newton metres.
    pub speed: Lanes<S>,
    pub strength: Lanes<S>,
    /// Impulses of the last sub-step, to start from.
    pub pull: [Lanes<S>; 2],
    pub drive: Lanes<S>,
    pub stop: Lanes<S>,
    /// What the motor gave over the last step, newton metres, and its work, joules.
    pub torque: Lanes<S>,
    pub work: Lanes<S>,
    /// How fast it turned after the last sub-step, radians a second.
    pub turning: Lanes<S>,
}

impl<S: Simd> Hinge<S> {
    pub fn new(
        joint: usize,
        (parent, child): (usize, usize),
        who: &Who<'_>,
        lift: Lanes<S>,
        bodies: &[Rigid<S>],
    ) -> Self {
        let zero = lift.like(0.0);
        let lanes = |value: &dyn Fn(&ambulo_body::Joint, &Physics) -> f32| {
            let mut values = [0.0; 16];
            for (lane, value_of) in values.iter_mut().enumerate() {
                let (body, physics) = who(lane);
                *value_of = value(&body.joints()[joint], physics);
            }
            lift.load_like(&values)
        };
        let anchor =
            [lanes(&|joint, _| joint.anchor[0]), lanes(&|joint, _| joint.anchor[1]) + lift];
        let local = [parent, child].map(|part| {
            let body = &bodies[part];
            [anchor[0] - body.x, anchor[1] - body.y]
        });
        let turning = bodies[parent].inverse_inertia + bodies[child].inverse_inertia;
        let mut made = Self {
            parent,
            child,
            local,
            arm: local,
            between: [zero; 2],
            mass: [zero; 3],
            axial: zero.like(1.0) / turning,
            limits: [lanes(&|joint, _| joint.limits[0]), lanes(&|joint, _| joint.limits[1])],
            side: zero,
            limit: zero,
            limited: false,
            speed: zero,
            strength: lanes(&|joint, physics| joint.torque * physics.torque_scale),
            pull: [zero; 2],
            drive: zero,
            stop: zero,
            torque: zero,
            work: zero,
            turning: zero,
        };
        made.aim(bodies);
        made
    }

    /// Arms and effective mass for where the bodies are now.
    #[inline(always)]
    pub fn aim(&mut self, bodies: &[Rigid<S>]) {
        let (a, b) = (&bodies[self.parent], &bodies[self.child]);
        let (ra, rb) = (a.turned(self.local[0]), b.turned(self.local[1]));
        self.arm = [ra, rb];
        let (ia, ib) = (a.inverse_inertia, b.inverse_inertia);
        let mass = a.inverse_mass + b.inverse_mass;
        let xx = mass + ra[1] * ra[1] * ia + rb[1] * rb[1] * ib;
        let yy = mass + ra[0] * ra[0] * ia + rb[0] * rb[0] * ib;
        let xy = -(ra[1] * ra[0] * ia + rb[1] * rb[0] * ib);
        let scale = mass.like(1.0) / (xx * yy - xy * xy);
        self.mass = [yy * scale, -(xy * scale), xx * scale];
    }

    /// From the parent's side of the hinge to the child's, metres, while a step goes on.
    #[inline(always)]
    pub fn error(&self, bodies: &[Rigid<S>]) -> [Lanes<S>; 2] {
        let (a, b) = (&bodies[self.parent], &bodies[self.child]);
        let [ra, rb] = self.arm;
        [
            (b.dx - a.dx) + (rb[0] - ra[0]) + self.between[0],
            (b.dy - a.dy) + (rb[1] - ra[1]) + self.between[1],
        ]
    }

    /// The same between steps.
    pub fn gap(&self, bodies: &[Rigid<S>]) -> [Lanes<S>; 2] {
        let (a, b) = (&bodies[self.parent], &bodies[self.child]);
        let (ra, rb) = (a.turned(self.local[0]), b.turned(self.local[1]));
        [(b.x - a.x) + (rb[0] - ra[0]), (b.y - a.y) + (rb[1] - ra[1])]
    }
}
