//! Corners and the ground that they touch.

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Mask, Simd};

use super::parts::{Rigid, Rules, Who};
use super::sides::Sides;
use super::terrain::Terrain;
use crate::Physics;
use crate::world::turn;

/// The least distance from which a contact is prepared, metres.
const MARGIN: f32 = 0.02;
/// The same on uneven ground, where solving costs little beside looking, and who is thrown through a
/// wall within a step is not back as soon as who is thrown through a floor.
pub const UNEVEN_MARGIN: f32 = 0.1;

/// A point of a part, with a radius around it, that the ground holds up. On uneven ground there are
/// two for each, for the two nearest places of the ground, and two for a part's sides, of which the
/// point is wherever a corner of the ground touches them.
#[derive(Clone, Copy, Debug)]
pub struct Corner<S: Simd> {
    pub part: usize,
    local: [Lanes<S>; 2],
    radius: Lanes<S>,
    friction: Lanes<S>,
    /// Distance to the ground when it was last looked at, metres.
    distance: Lanes<S>,
    /// Of the ground there, pointing out of it; upright on flat ground.
    normal: [Lanes<S>; 2],
    /// From the centre of mass to the point itself when it was last looked at.
    start: [Lanes<S>; 2],
    /// From the centre of mass to where the ground pushes.
    arm: [Lanes<S>; 2],
    /// Along and across what the ground pushes.
    mass: [Lanes<S>; 2],
    /// Impulses of the last sub-step: away from the ground and along it.
    push: Lanes<S>,
    rub: Lanes<S>,
    near: Mask<S>,
    /// Whether any lane is near.
    pub active: bool,
}

impl<S: Simd> Corner<S> {
    /// All corners of a body, where `sides` is given (on uneven ground) with those of its sides.
    pub fn all(simd: S, who: &Who<'_>, sides: &[Sides<S>]) -> Vec<Self> {
        let mut corners = Vec::new();
        let (body, _) = who(0);
        for part in 0..body.parts().len() {
            for corner in 0..body.parts()[part].shape.hull().0.len() {
                let places = if sides.is_empty() { 1 } else { 2 };
                corners.extend([Self::new(simd, part, corner, who)].repeat(places));
            }
            let count = sides.get(part).map_or(0, |sides| sides.lying.len());
            let side = Self { radius: Lanes::zero(simd), ..Self::new(simd, part, 0, who) };
            corners.extend([side].repeat(count));
        }
        corners
    }

    fn new(simd: S, part: usize, corner: usize, who: &Who<'_>) -> Self {
        let lanes = |value: &dyn Fn(&Body, &Physics) -> f32| {
            Lanes::from_fn(simd, |lane| value(who(lane).0, who(lane).1))
        };
        let local = |body: &Body, axis: usize| {
            let part = &body.parts()[part];
            let (at, centre) = (part.shape.hull().0[corner], part.shape.centre());
            turn([at[0] - centre[0], at[1] - centre[1]], part.angle)[axis]
        };
        let zero = Lanes::zero(simd);
        Self {
            part,
            local: [lanes(&|body, _| local(body, 0)), lanes(&|body, _| local(body, 1))],
            radius: lanes(&|body, _| body.parts()[part].shape.hull().1),
            friction: lanes(&|body, physics| {
                let both = body.parts()[part].friction * physics.ground_friction;
                libm::sqrtf(both) * physics.friction_scale
            }),
            distance: zero,
            normal: [zero, zero.like(1.0)],
            start: [zero; 2],
            arm: [zero; 2],
            mass: [zero; 2],
            push: zero,
            rub: zero,
            near: Mask::never(simd),
            active: false,
        }
    }

    /// Distance to the ground, metres.
    pub fn least(&self) -> Lanes<S> {
        self.distance
    }

    /// Looks where flat ground is.
    #[inline(always)]
    pub fn look(&mut self, body: &Rigid<S>) {
        self.start = body.turned(self.local);
        self.distance = body.y + self.start[1] - self.radius;
    }

    /// Looks where uneven ground is, for both corners of a point at which two sides meet.
    #[inline(always)]
    pub fn look_around(
        corners: &mut [Self],
        sides: [[Lanes<S>; 2]; 2],
        body: &Rigid<S>,
        terrain: &Terrain,
        rules: &Rules<S>,
    ) {
        let start = body.turned(corners[0].local);
        let at = [body.x + start[0], body.y + start[1]];
        // As far as a contact is prepared from, whichever way the point goes.
        let speed = (body.vx - body.w * start[1]).abs() + (body.vy + body.w * start[0]).abs();
        let reach = speed * rules.dt * 2.0 + UNEVEN_MARGIN;
        let [(da, na), (db, nb)] = terrain.nearest(at, corners[0].radius, reach, sides);
        // Each goes to the corner that pushed more in its direction: impulses of before fit.
        let [ma, mb] = [corners[0].normal, corners[1].normal];
        let (dx, dy) = (na[0] - nb[0], na[1] - nb[1]);
        let cross = (dx * (ma[0] - mb[0]) + dy * (ma[1] - mb[1])).less(da.like(0.0));
        for (corner, swap) in corners.iter_mut().zip([cross, !cross]) {
            corner.start = start;
            corner.distance = swap.choose(db, da);
            corner.normal = [swap.choose(nb[0], na[0]), swap.choose(nb[1], na[1])];
        }
    }

    /// A side lies on a corner of the ground, `at` from the centre of mass; `distance` is from where
    /// the centre of mass was before the step.
    #[inline(always)]
    pub fn lie(
        &mut self,
        body: &Rigid<S>,
        distance: Lanes<S>,
        normal: [Lanes<S>; 2],
        at: [Lanes<S>; 2],
    ) {
        self.local = body.unturned(at);
        (self.distance, self.normal, self.start, self.arm) = (distance, normal, at, at);
    }

    /// Forgets the impulses of before where they are those of `other` contacts.
    #[inline(always)]
    pub fn start_over(&mut self, other: Mask<S>) {
        (self.push, self.rub) = ((!other).keep(self.push), (!other).keep(self.rub));
    }

    /// Before a step: who is near enough to touch within it, and what a push there does.
    #[inline(always)]
    pub fn prepare<const FLAT: bool>(&mut self, body: &Rigid<S>, rules: &Rules<S>) {
        let [nx, ny] = self.normal;
        let [rx, ry] = self.start;
        // From where the point is and how fast; the rest of the part may swing it a little more.
        let towards = if FLAT {
            -(body.vy + body.w * rx)
        } else {
            -((body.vx - body.w * ry) * nx + (body.vy + body.w * rx) * ny)
        };
        let least = if FLAT { MARGIN } else { UNEVEN_MARGIN };
        let margin = towards.max(towards.like(0.0)) * rules.dt * 2.0 + least;
        self.near = self.distance.less(margin);
        self.active = self.near.any();
        if !self.active {
            (self.push, self.rub) = (self.push.like(0.0), self.rub.like(0.0));
            return;
        }
        self.push = self.near.keep(self.push);
        self.rub = self.near.keep(self.rub);
        self.arm = if FLAT {
            [rx, ry - self.radius]
        } else {
            [rx - nx * self.radius, ry - ny * self.radius]
        };
        let [ax, ay] = self.arm;
        let (along, across) =
            if FLAT { (ax, -ay) } else { (ax * ny - ay * nx, -(ax * nx + ay * ny)) };
        let one = nx.like(1.0);
        self.mass = [along, across]
            .map(|lever| one / (body.inverse_mass + body.inverse_inertia * lever * lever));
    }

    #[inline(always)]
    fn apply<const FLAT: bool>(&self, body: &mut Rigid<S>, push: Lanes<S>, rub: Lanes<S>) {
        let [ax, ay] = self.arm;
        let [x, y] = if FLAT {
            [rub, push]
        } else {
            let [nx, ny] = self.normal;
            [push * nx + rub * ny, push * ny - rub * nx]
        };
        body.vx += body.inverse_mass * x;
        body.vy += body.inverse_mass * y;
        body.w += body.inverse_inertia * (ax * y - ay * x);
    }

    #[inline(always)]
    pub fn warm<const FLAT: bool>(&self, body: &mut Rigid<S>) {
        self.apply::<FLAT>(body, self.push, self.rub);
    }

    /// Keeps it out of the ground; softly corrected if `SOFT`, else with friction.
    #[inline(always)]
    pub fn solve<const FLAT: bool, const SOFT: bool>(
        &mut self,
        body: &mut Rigid<S>,
        rules: &Rules<S>,
    ) {
        let [ax, ay] = self.arm;
        let [nx, ny] = self.normal;
        let zero = nx.like(0.0);
        let moved = body.turned(self.local);
        let distance = if FLAT {
            self.distance + (body.dy + (moved[1] - self.start[1]))
        } else {
            let x = body.dx + (moved[0] - self.start[0]);
            let y = body.dy + (moved[1] - self.start[1]);
            self.distance + (x * nx + y * ny)
        };
        let [mut vx, mut vy, mut w] = [body.vx, body.vy, body.w];
        let speed = if FLAT { vy + w * ax } else { (vx - w * ay) * nx + (vy + w * ax) * ny };
        let apart = distance.greater(zero);
        let ahead = distance * rules.per_h;
        let change = if SOFT {
            let soft =
                (rules.contact.mass * rules.contact.rate * distance).max(zero.like(FASTEST_OUT));
            let scaled = apart.choose(speed, rules.contact.mass * speed);
            let bias = apart.choose(ahead, soft);
            let given = apart.choose(zero, rules.contact.impulse * self.push);
            self.mass[0] * (scaled + bias) + given
        } else {
            self.mass[0] * (speed + apart.keep(ahead))
        };
        let push = self.near.keep((self.push - change).max(zero));
        let given = push - self.push;
        self.push = push;
        if FLAT {
            vy += body.inverse_mass * given;
            w += body.inverse_inertia * (ax * given);
        } else {
            vx += body.inverse_mass * (given * nx);
            vy += body.inverse_mass * (given * ny);
            w += body.inverse_inertia * ((ax * ny - ay * nx) * given);
        }
        if !SOFT {
            let slip = if FLAT { vx - w * ay } else { (vx - w * ay) * ny - (vy + w * ax) * nx };
            let most = self.friction * push;
            let rub = (self.rub - self.mass[1] * slip).clamp(-most, most);
            let given = rub - self.rub;
            self.rub = rub;
            if FLAT {
                vx += body.inverse_mass * given;
                w -= body.inverse_inertia * (ay * given);
            } else {
                vx += body.inverse_mass * (given * ny);
                vy -= body.inverse_mass * (given * nx);
                w -= body.inverse_inertia * ((ax * nx + ay * ny) * given);
            }
        }
        (body.vx, body.vy, body.w) = (vx, vy, w);
    }
}

/// The fastest that the ground pushes out what is in it, metres a second: Box2D's.
const FASTEST_OUT: f32 = -3.0;
