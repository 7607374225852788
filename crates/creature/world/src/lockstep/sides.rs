//! Sides of a part and the corners of the ground that they lie on.

use std::ops::Range;

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Mask, Simd};

use super::contact::{Corner, UNEVEN_MARGIN};
use super::parts::{Rigid, Rules, Who};
use super::terrain::Terrain;
use crate::world::turn;

/// Where nothing is near, metres.
const FAR: f32 = 1000.0;
/// The farthest that is looked for corners, metres: who flies apart must not look at all of them.
const FARTHEST: f32 = 2.0;
/// How far a corner that passes a side's end within a step may be beyond it, metres.
const PASSING: f32 = 0.1;
/// What lies on many corners does not get restless if the outer one of those that are as deep counts:
/// as if the part were tilted by so much.
const OUTWARD: f32 = 0.003;

/// The outline of a part without its corners: a circle has none, a capsule two, there and back.
pub struct Sides<S: Simd> {
    pub part: usize,
    /// Contacts of its points.
    pub points: Range<usize>,
    /// Contacts of its sides: with the deepest corner to the left of the centre of mass and with the
    /// one to the right, so that what lies on two does not tip over.
    pub lying: Range<usize>,
    sides: Vec<Side<S>>,
    /// Radius around the centre of mass within which they are.
    size: Lanes<S>,
    /// What lies, to the left and to the right.
    held: Vec<Held<S>>,
}

/// A side that lies on a corner of the ground.
#[derive(Clone, Copy)]
struct Held<S: Simd> {
    /// Numbers of the corner and of the side.
    number: Lanes<S>,
    which: Lanes<S>,
    side: Side<S>,
    /// From where the centre of mass was before the step to the corner.
    at: [Lanes<S>; 2],
}

#[derive(Clone, Copy)]
struct Side<S: Simd> {
    /// Outward, in the start pose and as it is turned now.
    local: [Lanes<S>; 2],
    normal: [Lanes<S>; 2],
    /// How far out it is, and from where to where along it, counter-clockwise, it goes.
    over: Lanes<S>,
    along: [Lanes<S>; 2],
}

impl<S: Simd> Sides<S> {
    /// `first`: where its contacts are.
    pub fn new(simd: S, part: usize, first: usize, who: &Who<'_>) -> Self {
        let points = who(0).0.parts()[part].shape.hull().0.len();
        let count = if points > 1 { points } else { 0 };
        let sides: Vec<_> = (0..count).map(|index| Side::new(simd, part, index, who)).collect();
        let size = sides.iter().fold(Lanes::zero(simd), |size, side| {
            let along = side.along[1].max(-side.along[0]);
            size.max((side.over * side.over + along * along).sqrt())
        });
        let zero = Lanes::zero(simd);
        let held =
            sides.iter().map(|&side| Held { number: zero, which: zero, side, at: [zero; 2] });
        let held: Vec<_> = held.take(2).collect();
        let lying = first + 2 * points;
        Self { part, points: first..lying, lying: lying..lying + held.len(), sides, size, held }
    }

    /// Turns with the part.
    #[inline(always)]
    pub fn turn(&mut self, body: &Rigid<S>) {
        for side in &mut self.sides {
            side.normal = body.turned(side.local);
        }
    }

    /// Directions of the sides that meet at a point, the one that ends there and the one that begins.
    #[inline(always)]
    pub fn at(&self, point: usize) -> [[Lanes<S>; 2]; 2] {
        let count = self.sides.len();
        if count == 0 {
            return [[self.size.like(0.0); 2]; 2];
        }
        [(point + count - 1) % count, point].map(|side| {
            let [nx, ny] = self.sides[side].normal;
            [-ny, nx]
        })
    }

    /// Looks where corners of the ground are nearest, or deepest within.
    #[inline(always)]
    pub fn look(
        &mut self,
        contacts: &mut [Corner<S>],
        body: &Rigid<S>,
        terrain: &Terrain,
        rules: &Rules<S>,
    ) {
        if contacts.is_empty() {
            return;
        }
        let zero = body.x.like(0.0);
        let speed = body.vx.abs() + body.vy.abs() + body.w.abs() * self.size;
        let reach = (speed * rules.dt * 2.0 + UNEVEN_MARGIN).min(zero.like(FARTHEST)) + self.size;
        let ranges = terrain.peaks([body.x, body.y], reach);
        let most = ranges.iter().map(|range| range.len()).max().unwrap_or(0);
        let far = zero.like(FAR);
        // What distance counts, distance, place, number, and that of the side.
        let mut found = [[far, far, zero, zero, zero, zero]; 2];
        for next in 0..most {
            let [x, y, out_x, out_y, wide, number] = terrain.peak(&ranges, next, zero);
            let (x, y) = (x - body.x, y - body.y);
            // How far the part will have passed it by.
            let pass = [body.vx - body.w * y, body.vy + body.w * x].map(|speed| speed * rules.dt);
            let [mut best, mut which, mut outermost, mut closing] = [-far, zero, -far, zero];
            for (index, side) in self.sides.iter().enumerate() {
                let [nx, ny] = side.normal;
                let over = nx * x + ny * y - side.over;
                let along = nx * y - ny * x;
                let then = along + (ny * pass[0] - nx * pass[1]);
                outermost = outermost.max(over);
                // Beyond its ends it is a matter of the part's corners, and from elsewhere than where
                // the ground's corner sticks out to it is not to be pushed.
                let fits = (side.spans(along, 0.0)
                    | side.spans(along, PASSING) & side.spans(then, 0.0) & over.greater(zero))
                    & (nx * out_x + ny * out_y).less(-wide)
                    & over.greater(best);
                best = fits.choose(over, best);
                which = fits.choose(zero.like(index as f32), which);
                closing = fits.choose(nx * pass[0] + ny * pass[1], closing);
            }
            // It is within the outline, or in front of that side.
            let seen = !best.less(-self.size) & !(best.less(zero) & outermost.greater(zero));
            // At the end of the step; of two that are as deep then the outer one.
            let counts = best - closing - x.abs() * OUTWARD;
            let left = x.less(zero);
            for (found, here) in found.iter_mut().zip([left, !left]) {
                let better = here & seen & counts.less(found[0]);
                for (found, new) in found.iter_mut().zip([counts, best, x, y, number, which]) {
                    *found = better.choose(new, *found);
                }
            }
        }
        let lying = contacts.iter_mut().zip(&mut self.held);
        for ((contact, held), [_, distance, x, y, number, which]) in lying.zip(found) {
            let unlike = |a: Lanes<S>, b: Lanes<S>| a.less(b) | b.less(a);
            let other = unlike(number, held.number) | unlike(which, held.which);
            let mut side = self.sides[0];
            for (index, another) in self.sides.iter().enumerate().skip(1) {
                side = another.or(side, !unlike(which, zero.like(index as f32)));
            }
            *held = Held { number, which, side, at: [x, y] };
            let [nx, ny] = side.normal;
            contact.lie(body, distance, [-nx, -ny], [x, y]);
            contact.start_over(other);
        }
    }

    /// Looks where they are in the middle of a step: what turns fast does not lie as it did.
    #[inline(always)]
    pub fn follow(&self, contacts: &mut [Corner<S>], body: &Rigid<S>) {
        let lying = contacts.iter_mut().zip(&self.held);
        for (contact, Held { side, at, .. }) in lying.filter(|(contact, _)| contact.active) {
            let [nx, ny] = body.turned(side.local);
            let [x, y] = [at[0] - body.dx, at[1] - body.dy];
            // Before the step it would have been as far away as this if it had been turned like this.
            let distance = nx * at[0] + ny * at[1] - side.over;
            let distance = side.spans(nx * y - ny * x, PASSING).choose(distance, x.like(FAR));
            contact.lie(body, distance, [-nx, -ny], [x, y]);
        }
    }
}

impl<S: Simd> Side<S> {
    fn new(simd: S, part: usize, index: usize, who: &Who<'_>) -> Self {
        let measure = |body: &Body| {
            let part = &body.parts()[part];
            let ((hull, radius), centre) = (part.shape.hull(), part.shape.centre());
            let [[ax, ay], [bx, by]] = [index, index + 1].map(|point| {
                let [x, y] = hull[point % hull.len()];
                turn([x - centre[0], y - centre[1]], part.angle)
            });
            let length = libm::hypotf(bx - ax, by - ay);
            let [tx, ty] = [(bx - ax) / length, (by - ay) / length];
            let from = ax * tx + ay * ty;
            [ty, -tx, ax * ty - ay * tx + radius, from, from + length]
        };
        let [x, y, over, from, to] =
            [0, 1, 2, 3, 4].map(|what| Lanes::from_fn(simd, |lane| measure(who(lane).0)[what]));
        Self { local: [x, y], normal: [x, y], over, along: [from, to] }
    }

    /// Whether it has a place so far along, or had if it were so much longer.
    #[inline(always)]
    fn spans(&self, along: Lanes<S>, more: f32) -> Mask<S> {
        along.greater(self.along[0] - more) & along.less(self.along[1] + more)
    }

    /// This one in some lanes, another elsewhere.
    #[inline(always)]
    fn or(self, other: Self, here: Mask<S>) -> Self {
        let both =
            |[a, b]: [Lanes<S>; 2], [c, d]: [Lanes<S>; 2]| [here.choose(a, c), here.choose(b, d)];
        Self {
            local: both(self.local, other.local),
            normal: both(self.normal, other.normal),
            over: here.choose(self.over, other.over),
            along: both(self.along, other.along),
        }
    }
}
