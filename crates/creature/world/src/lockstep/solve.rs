//! One step of all lanes.

use ambulo_lanes::Simd;

use super::contact::Corner;
use super::parts::{Hinge, Rigid, Rules};
use super::{Lockstep, TOUCHING};

/// A gap between the two sides of a joint that is left alone, metres: what soft joints need to carry
/// what they carry. Less of it lets standing creatures sink.
const SLOP: f32 = 0.0065;
/// How often all joints are closed after a step at most; with three no gap is wider than 1 cm.
const SWEEPS: usize = 3;

impl<S: Simd> Lockstep<S> {
    #[inline(always)]
    pub(super) fn advance<const FLAT: bool>(&mut self) {
        let rules = self.rules;
        if self.water {
            for body in &mut self.bodies {
                body.wade();
            }
        }
        for hinge in &mut self.hinges {
            hinge.prepare(&self.bodies, &rules);
        }
        for corner in &mut self.corners {
            corner.prepare::<FLAT>(&self.bodies[corner.part], &rules);
        }
        let fall = rules.h * rules.gravity;
        for _ in 0..self.substeps {
            for body in &mut self.bodies {
                body.vy -= fall;
            }
            for hinge in &self.hinges {
                hinge.warm(&mut self.bodies);
            }
            for corner in self.corners.iter().filter(|corner| corner.active) {
                corner.warm::<FLAT>(&mut self.bodies[corner.part]);
            }
            self.pass::<FLAT, true>(&rules);
            for body in &mut self.bodies {
                body.advance(rules.h, rules.fastest);
            }
            for hinge in &mut self.hinges {
                hinge.aim(&self.bodies);
            }
            if !FLAT {
                for sides in &self.sides {
                    let lying = &mut self.corners[sides.lying.clone()];
                    sides.follow(lying, &self.bodies[sides.part]);
                }
            }
            self.pass::<FLAT, false>(&rules);
            for hinge in &mut self.hinges {
                hinge.account(&self.bodies);
            }
        }
        for _ in 0..SWEEPS {
            // What is not wide is left alone, so nobody notices how often others are looked at.
            if !self
                .hinges
                .iter_mut()
                .fold(false, |wide, hinge| hinge.close(&mut self.bodies) | wide)
            {
                break;
            }
        }
        for body in &mut self.bodies {
            body.x += body.dx;
            body.y += body.dy;
            (body.dx, body.dy) = (fall.like(0.0), fall.like(0.0));
        }
        for hinge in &mut self.hinges {
            hinge.torque = hinge.torque / rules.dt;
        }
        self.look();
    }

    #[inline(always)]
    fn pass<const FLAT: bool, const SOFT: bool>(&mut self, rules: &Rules<S>) {
        for hinge in &mut self.hinges {
            hinge.solve::<SOFT>(&mut self.bodies, rules);
        }
        for corner in self.corners.iter_mut().filter(|corner| corner.active) {
            corner.solve::<FLAT, SOFT>(&mut self.bodies[corner.part], rules);
        }
    }

    /// Where the ground is, after everything has moved.
    #[inline(always)]
    pub(super) fn look(&mut self) {
        for touching in &mut self.touching {
            *touching = ambulo_lanes::Mask::never(self.simd);
        }
        if self.flat {
            for corner in &mut self.corners {
                corner.look(&self.bodies[corner.part]);
            }
        } else {
            for sides in &mut self.sides {
                let body = &self.bodies[sides.part];
                sides.turn(body);
                let points = self.corners[sides.points.clone()].chunks_exact_mut(2);
                for (point, both) in points.enumerate() {
                    Corner::look_around(both, sides.at(point), body, &self.ground, &self.rules);
                }
                let lying = &mut self.corners[sides.lying.clone()];
                sides.look(lying, body, &self.ground, &self.rules);
            }
        }
        for corner in &self.corners {
            let distance = corner.least();
            let near = distance.less(distance.like(TOUCHING));
            self.touching[corner.part] = self.touching[corner.part] | near;
        }
    }
}

impl<S: Simd> Hinge<S> {
    /// Before a step: where its ends are, and which limit is near.
    #[inline(always)]
    fn prepare(&mut self, bodies: &[Rigid<S>], rules: &Rules<S>) {
        let (a, b) = (&bodies[self.parent], &bodies[self.child]);
        self.between = [b.x - a.x, b.y - a.y];
        let zero = a.x.like(0.0);
        (self.torque, self.work) = (zero, zero);
        self.turning = b.w - a.w;
        let angle = b.angle - a.angle;
        let (over, under) = (angle - self.limits[0], self.limits[1] - angle);
        let lower = over.less(under);
        // As far as it can turn in a step.
        let fastest = (b.w - a.w).abs().max(self.speed.abs());
        let near = over.min(under).less(fastest * rules.dt * 2.0 + 0.1);
        let one = zero.like(1.0);
        let side = near.keep(lower.choose(one, -one));
        let same = !(side.less(self.side) | self.side.less(side));
        self.stop = same.keep(self.stop);
        self.side = side;
        self.limit = lower.choose(self.limits[0], self.limits[1]);
        self.limited = near.any();
    }

    /// Begins with the impulses of the last sub-step.
    #[inline(always)]
    fn warm(&self, bodies: &mut [Rigid<S>]) {
        let [px, py] = self.pull;
        let [ra, rb] = self.arm;
        let turn = self.drive + self.side * self.stop;
        let a = &mut bodies[self.parent];
        a.vx -= a.inverse_mass * px;
        a.vy -= a.inverse_mass * py;
        a.w -= a.inverse_inertia * (ra[0] * py - ra[1] * px + turn);
        let b = &mut bodies[self.child];
        b.vx += b.inverse_mass * px;
        b.vy += b.inverse_mass * py;
        b.w += b.inverse_inertia * (rb[0] * py - rb[1] * px + turn);
    }

    /// After a step: where the hinge gapes wider than [`SLOP`], moves and turns both sides together by
    /// their masses, and says whether it did in any lane. Their common centre of mass stays where it
    /// is and speeds stay what they are, so this adds no energy (Müller et al., "Position Based
    /// Dynamics", 2007).
    #[inline(always)]
    fn close(&mut self, bodies: &mut [Rigid<S>]) -> bool {
        let (a, b) = (&bodies[self.parent], &bodies[self.child]);
        self.arm = [a.turned(self.local[0]), b.turned(self.local[1])];
        let [ex, ey] = self.error(bodies);
        let square = ex * ex + ey * ey;
        let wide = square.greater(square.like(SLOP * SLOP));
        if !wide.any() {
            return false;
        }
        let share = wide.keep(square.like(1.0) - square.like(SLOP) / square.sqrt());
        let (ex, ey) = (share * ex, share * ey);
        let [xx, xy, yy] = self.mass;
        let (px, py) = (-(xx * ex + xy * ey), -(xy * ex + yy * ey));
        let [ra, rb] = self.arm;
        bodies[self.parent].shift([-px, -py], ra);
        bodies[self.child].shift([px, py], rb);
        true
    }

    /// After a sub-step: what the motor gave and did. An impulse's work is itself times the mean of
    /// the speeds before and after all impulses.
    #[inline(always)]
    fn account(&mut self, bodies: &[Rigid<S>]) {
        let turning = bodies[self.child].w - bodies[self.parent].w;
        self.torque += self.drive;
        self.work += self.drive * (self.turning + turning) * 0.5;
        self.turning = turning;
    }

    /// Motor, limit, hinge; softly corrected if `SOFT`.
    #[inline(always)]
    fn solve<const SOFT: bool>(&mut self, bodies: &mut [Rigid<S>], rules: &Rules<S>) {
        let (mut a, mut b) = (bodies[self.parent], bodies[self.child]);
        let zero = a.x.like(0.0);
        let (ia, ib) = (a.inverse_inertia, b.inverse_inertia);
        let (mut wa, mut wb) = (a.w, b.w);

        let most = self.strength * rules.h;
        let drive = (self.drive - self.axial * ((wb - wa) - self.speed)).clamp(-most, most);
        let given = drive - self.drive;
        self.drive = drive;
        wa -= ia * given;
        wb += ib * given;

        if self.limited {
            let over = self.side * (b.angle - a.angle - self.limit);
            let free = over.greater(zero);
            let ahead = over * rules.per_h;
            let speed = self.side * (wb - wa);
            let change = if SOFT {
                let softly = rules.joint.mass * (speed + rules.joint.rate * over);
                let change = free.choose(speed + ahead, softly);
                self.axial * change + free.choose(zero, rules.joint.impulse * self.stop)
            } else {
                self.axial * (speed + free.keep(ahead))
            };
            let stop = (self.stop - change).max(zero) * self.side.abs();
            let given = self.side * (stop - self.stop);
            self.stop = stop;
            wa -= ia * given;
            wb += ib * given;
        }

        let [ra, rb] = self.arm;
        let mut cx = (b.vx - wb * rb[1]) - (a.vx - wa * ra[1]);
        let mut cy = (b.vy + wb * rb[0]) - (a.vy + wa * ra[0]);
        if SOFT {
            let [ex, ey] = self.error(bodies);
            cx += rules.joint.rate * ex;
            cy += rules.joint.rate * ey;
        }
        let [xx, xy, yy] = self.mass;
        let (mut px, mut py) = (-(xx * cx + xy * cy), -(xy * cx + yy * cy));
        if SOFT {
            px = rules.joint.mass * px - rules.joint.impulse * self.pull[0];
            py = rules.joint.mass * py - rules.joint.impulse * self.pull[1];
        }
        self.pull = [self.pull[0] + px, self.pull[1] + py];
        a.vx -= a.inverse_mass * px;
        a.vy -= a.inverse_mass * py;
        a.w = wa - ia * (ra[0] * py - ra[1] * px);
        b.vx += b.inverse_mass * px;
        b.vy += b.inverse_mass * py;
        b.w = wb + ib * (rb[0] * py - rb[1] * px);
        let body = &mut bodies[self.parent];
        (body.vx, body.vy, body.w) = (a.vx, a.vy, a.w);
        let body = &mut bodies[self.child];
        (body.vx, body.vy, body.w) = (b.vx, b.vy, b.w);
    }
}
