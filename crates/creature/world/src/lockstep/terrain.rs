//! Where uneven ground is nearest.

use std::ops::Range;

use ambulo_lanes::{Lanes, Simd};

use crate::Outline;

/// In a hollow a face holds this far beyond its end, metres: who is a little in one of its two faces
/// still has the other one in front.
const BEYOND: f32 = 0.1;
/// A corner of the ground so far to the side of a part's corner, as a sine, is still in front of it.
const ASIDE: f32 = 1e-3;
/// Less than this above the ground is on it, metres.
const ON: f32 = 1e-4;

/// How finely places are looked up, metres.
const CELL: f32 = 0.25;
/// How far from where it sticks out to a corner pushes: beyond its faces' normals by a fifth of a
/// radian, as what lies on both ends of a face pivots a little on each.
const PIVOT: f32 = 0.2;

/// Distance to the ground, negative inside, and the direction out of it.
type Place = (f32, [f32; 2]);
/// Where nothing is near; unlike any direction that a place has.
const NOWHERE: Place = (1000.0, [0.0, -1.0]);

/// The ground's line as faces, from left to right.
#[derive(Clone, Debug)]
pub struct Terrain {
    pub outline: Outline,
    faces: Vec<Face>,
    peaks: Vec<Peak>,
    /// From the first point on.
    cells: Vec<Cell>,
}

/// What is where: a face that begins before it does, the first corner in it, its highest place.
#[derive(Clone, Copy, Debug)]
struct Cell {
    face: usize,
    peak: usize,
    highest: f32,
}

/// A corner that sticks out: where to, and the cosine of how far from there it pushes.
#[derive(Clone, Copy, Debug)]
struct Peak {
    at: [f32; 2],
    out: [f32; 2],
    wide: f32,
}

/// A stretch of it. The ground is to the right of who walks along.
#[derive(Clone, Copy, Debug)]
struct Face {
    start: [f32; 2],
    along: [f32; 2],
    length: f32,
    /// Whether a hollow is at its ends.
    hollow: [bool; 2],
}

impl Terrain {
    pub fn new(outline: Outline) -> Self {
        let faces = outline.points().windows(2).filter(|ends| ends[0] != ends[1]);
        let mut faces: Vec<_> = faces.map(|ends| Face::new(ends[0], ends[1])).collect();
        let mut peaks = Vec::new();
        for right in 1..faces.len() {
            let ([ax, ay], [bx, by]) = (faces[right - 1].along, faces[right].along);
            if ax * by > ay * bx {
                (faces[right - 1].hollow[1], faces[right].hollow[0]) = (true, true);
            } else if ax * by < ay * bx {
                let length = libm::hypotf(ax + bx, ay + by);
                let out = [-(ay + by) / length, (ax + bx) / length];
                let (cos, sin) = (out[1] * ax - out[0] * ay, out[0] * ax + out[1] * ay);
                let wide = cos * libm::cosf(PIVOT) - sin * libm::sinf(PIVOT);
                peaks.push(Peak { at: faces[right].start, out, wide });
            }
        }
        let mut made = Self { outline, faces, peaks, cells: vec![] };
        made.look_up();
        made
    }

    /// Fills the cells.
    fn look_up(&mut self) {
        let points = self.outline.points();
        let (left, right) = (points[0][0], points[points.len() - 1][0]);
        let (mut face, mut peak) = (0, 0);
        for index in 0..=((right - left) / CELL) as usize {
            let x = left + CELL * index as f32;
            while self.faces.get(face + 1).is_some_and(|face| face.start[0] < x) {
                face += 1;
            }
            while self.peaks.get(peak).is_some_and(|peak| peak.at[0] < x) {
                peak += 1;
            }
            // A little beyond its ends, as numbers are rounded.
            let here = self.faces[face..].iter().take_while(|face| face.start[0] < x + 1.01 * CELL);
            let ends =
                here.flat_map(|face| [x - 0.01 * CELL, x + 1.01 * CELL].map(|x| face.height(x)));
            self.cells.push(Cell { face, peak, highest: ends.fold(f32::MIN, f32::max) });
        }
    }

    #[inline(always)]
    fn cell(&self, x: f32) -> usize {
        // A number below 0, or none at all, becomes 0.
        (((x - self.outline.points()[0][0]) / CELL) as usize).min(self.cells.len() - 1)
    }

    /// What is at the left end of what is within reach, and whether anything there is high enough.
    #[inline(always)]
    fn within(&self, [x, y]: [f32; 2], reach: f32) -> (&Cell, bool) {
        let cells = &self.cells[self.cell(x - reach)..=self.cell(x + reach)];
        (&cells[0], !cells.iter().all(|cell| cell.highest < y - reach))
    }

    /// Which corners may be within `reach` of a point, lane by lane.
    #[inline(always)]
    pub fn peaks<S: Simd>(&self, at: [Lanes<S>; 2], reach: Lanes<S>) -> [Range<usize>; 16] {
        let [mut x, mut y, mut far] = [[0.0; 16]; 3];
        at[0].store(&mut x);
        at[1].store(&mut y);
        reach.store(&mut far);
        std::array::from_fn(|lane| {
            let [x, far] = [x[lane], far[lane]];
            if lane >= Lanes::<S>::WIDTH {
                return 0..0;
            }
            let (cell, high) = self.within([x, y[lane]], far);
            let before = |peak: &&Peak, end: f32| high && peak.at[0] < end;
            let rest = &self.peaks[cell.peak..];
            let skip = rest.iter().take_while(|peak| before(peak, x - far)).count();
            let count = rest[skip..].iter().take_while(|peak| before(peak, x + far)).count();
            cell.peak + skip..cell.peak + skip + count
        })
    }

    /// The next corner of each lane: place, direction, width and number. Where there is none any more,
    /// none that pushes.
    #[inline(always)]
    pub fn peak<S: Simd>(
        &self,
        ranges: &[Range<usize>; 16],
        next: usize,
        like: Lanes<S>,
    ) -> [Lanes<S>; 6] {
        let mut all = [[0.0; 16]; 6];
        for (lane, range) in ranges.iter().enumerate() {
            let index = range.start + next;
            let none = Peak { at: [0.0; 2], out: [0.0; 2], wide: 2.0 };
            let peak = if index < range.end { self.peaks[index] } else { none };
            let Peak { at: [x, y], out: [out_x, out_y], wide } = peak;
            for (all, one) in all.iter_mut().zip([x, y, out_x, out_y, wide, index as f32]) {
                all[lane] = one;
            }
        }
        all.map(|values| like.load_like(&values))
    }

    /// The two places of the ground that are nearest to a circle around a point, if they are within
    /// `reach`, the nearest first. Corners of the ground that are in front of one of the `sides` that
    /// meet at the point, given by their directions, are not its business.
    #[inline(always)]
    pub fn nearest<S: Simd>(
        &self,
        at: [Lanes<S>; 2],
        radius: Lanes<S>,
        reach: Lanes<S>,
        sides: [[Lanes<S>; 2]; 2],
    ) -> [(Lanes<S>, [Lanes<S>; 2]); 2] {
        let [mut x, mut y, mut r, mut far] = [[0.0; 16]; 4];
        let mut turned = [[[0.0; 16]; 2]; 2];
        for (into, value) in turned.iter_mut().flatten().zip(sides.into_iter().flatten()) {
            value.store(into);
        }
        at[0].store(&mut x);
        at[1].store(&mut y);
        radius.store(&mut r);
        (radius + reach).store(&mut far);
        let mut found = [[[0.0; 16]; 3]; 2];
        for lane in 0..Lanes::<S>::WIDTH {
            let sides = turned.map(|side| side.map(|values| values[lane]));
            let places = self.nearest_one([x[lane], y[lane]], far[lane], sides);
            for (found, (distance, normal)) in found.iter_mut().zip(places) {
                found[0][lane] = distance - r[lane];
                (found[1][lane], found[2][lane]) = (normal[0], normal[1]);
            }
        }
        found.map(|[distance, x, y]| {
            (radius.load_like(&distance), [radius.load_like(&x), radius.load_like(&y)])
        })
    }

    /// One lane of it, as seen from the point.
    fn nearest_one(&self, [x, y]: [f32; 2], reach: f32, sides: [[f32; 2]; 2]) -> [Place; 2] {
        let mut found = Nearest([NOWHERE; 2]);
        let (cell, high) = self.within([x, y], reach);
        if !high {
            return found.0;
        }
        let next = |index: usize| self.faces.get(index + 1).map_or(f32::MAX, |face| face.start[0]);
        let mut first = cell.face;
        while next(first) < x - reach {
            first += 1;
        }
        let mut below = first;
        while next(below) <= x {
            below += 1;
        }
        let on = y < self.faces[below].height(x) + ON;
        // On or in the ground only the face that it is least deep in counts, and its neighbours in a
        // hollow: what is behind it is no ground to come out of.
        let mut through: Option<(usize, f32)> = None;
        let mut past = false;
        for (index, face) in self.faces.iter().enumerate().skip(first) {
            if face.start[0] > x + reach {
                break;
            }
            let (over, along) = face.seen([x, y]);
            if self.holds(index, along, [x, y]) {
                if on && over < ON {
                    if through.is_none_or(|(_, least)| over > least) {
                        through = Some((index, over));
                    }
                } else if over >= 0.0 && over < reach {
                    found.offer((over, face.normal()));
                }
            }
            if past && along < 0.0 {
                let (distance, [nx, ny]) = face.tip([x, y], reach);
                let beyond = |[tx, ty]: [f32; 2], side: f32| side * (nx * tx + ny * ty) < ASIDE;
                if beyond(sides[0], 1.0) && beyond(sides[1], -1.0) {
                    found.offer((distance, [nx, ny]));
                }
            }
            past = along > face.length;
        }
        if let Some((index, over)) = through {
            let face = &self.faces[index];
            found.offer((over, face.normal()));
            for (hollow, other) in face.hollow.into_iter().zip([index.wrapping_sub(1), index + 1]) {
                if hollow {
                    let (over, along) = self.faces[other].seen([x, y]);
                    if over < ON && self.holds(other, along, [x, y]) {
                        found.offer((over, self.faces[other].normal()));
                    }
                }
            }
        }
        found.0
    }

    /// Whether a face is there for a point that far along it: beyond its end only if the face that it
    /// meets there is.
    fn holds(&self, index: usize, along: f32, at: [f32; 2]) -> bool {
        let face = &self.faces[index];
        let meets = |other: usize| self.faces[other].spans(self.faces[other].seen(at).1);
        face.spans(along)
            && (along >= 0.0 || meets(index - 1))
            && (along <= face.length || meets(index + 1))
    }
}

impl Face {
    fn new([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> Self {
        let length = libm::hypotf(bx - ax, by - ay);
        let along = [(bx - ax) / length, (by - ay) / length];
        Self { start: [ax, ay], along, length, hollow: [false; 2] }
    }

    /// Out of the ground.
    fn normal(&self) -> [f32; 2] {
        [-self.along[1], self.along[0]]
    }

    /// How far over it a point is, and how far along.
    fn seen(&self, [x, y]: [f32; 2]) -> (f32, f32) {
        let ([dx, dy], [ax, ay]) = ([x - self.start[0], y - self.start[1]], self.along);
        (dy * ax - dx * ay, dx * ax + dy * ay)
    }

    /// Whether a point that far along is at the face, or beyond its end where a hollow is.
    fn spans(&self, along: f32) -> bool {
        let [before, after] = self.hollow.map(|hollow| if hollow { BEYOND } else { 0.0 });
        (-before..=self.length + after).contains(&along)
    }

    /// Height of its place at `x`, or of its nearer end.
    fn height(&self, x: f32) -> f32 {
        let along = ((x - self.start[0]) / self.along[0]).clamp(0.0, self.length);
        self.start[1] + along * self.along[1]
    }

    /// Its start, which sticks out.
    fn tip(&self, [x, y]: [f32; 2], reach: f32) -> Place {
        let (dx, dy) = (x - self.start[0], y - self.start[1]);
        let distance = libm::sqrtf(dx * dx + dy * dy);
        match distance > 0.0 && distance < reach {
            true => (distance, [dx / distance, dy / distance]),
            false => NOWHERE,
        }
    }
}

/// The two nearest so far, the nearest first.
struct Nearest([Place; 2]);

impl Nearest {
    fn offer(&mut self, place: Place) {
        if place.0 < self.0[0].0 {
            self.0 = [place, self.0[0]];
        } else if place.0 < self.0[1].0 {
            self.0[1] = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ground;

    const KINDS: [Ground; 6] = [
        Ground::Slope { angle: 0.9 },
        Ground::Steps { height: 0.2, length: 0.3 },
        Ground::Steps { height: -0.2, length: 0.3 },
        Ground::Holes { width: 0.4, between: 0.6 },
        Ground::Hurdles { height: 0.2, width: 0.1, between: 0.5 },
        Ground::Rough { height: 0.3, spacing: 0.3, seed: 1 },
    ];

    /// Distance from the line, whichever side of it.
    fn from_line(outline: &Outline, [x, y]: [f32; 2]) -> f32 {
        let distance = |ends: &[[f32; 2]]| {
            let ([ax, ay], [bx, by]) = (ends[0], ends[1]);
            let (ex, ey) = (bx - ax, by - ay);
            let part = (((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
            (x - ax - part * ex).hypot(y - ay - part * ey)
        };
        // As far as the lattice goes.
        outline.points()[..outline.points().len().min(80)]
            .windows(2)
            .map(distance)
            .fold(f32::MAX, f32::min)
    }

    /// A lattice of points above and below, from where it is level to well into it.
    fn points(outline: &Outline) -> impl Iterator<Item = [f32; 2]> + '_ {
        let at = move |x: f32| (-20..30).map(move |y| [x, outline.height(x) + 0.0071 * y as f32]);
        (0..300).map(|x| 2.5 + 0.0173 * x as f32).flat_map(at)
    }

    #[test]
    fn the_nearest_place_is_the_nearest() {
        for ground in KINDS {
            let terrain = Terrain::new(ground.outline());
            let mut inside = 0;
            for [x, y] in points(&terrain.outline) {
                let [(distance, [nx, ny]), (second, _)] =
                    terrain.nearest_one([x, y], 0.5, [[0.0; 2]; 2]);
                let expected = from_line(&terrain.outline, [x, y]);
                let height = terrain.outline.height(x);
                assert!(distance <= second && (nx.hypot(ny) - 1.0).abs() < 1e-5);
                if y > height + ON {
                    // In a hollow one may be nearer to where a face would go on.
                    assert!((distance - expected).abs() < 1e-4, "{ground:?} {x} {y}: {distance}");
                } else if y < height - ON && expected < BEYOND {
                    inside += 1;
                    assert!(
                        -distance < expected + 1e-4,
                        "{ground:?} {x} {y}: {distance} {expected}"
                    );
                }
            }
            assert!(inside > 1000, "{ground:?}");
        }
    }

    /// Both places together lead out of the ground, wherever one is a little inside.
    #[test]
    fn out_is_out() {
        for ground in KINDS {
            let terrain = Terrain::new(ground.outline());
            for [mut x, mut y] in points(&terrain.outline) {
                if y > terrain.outline.height(x) || from_line(&terrain.outline, [x, y]) > 0.02 {
                    continue;
                }
                let from = [x, y];
                for _ in 0..4 {
                    for (distance, [nx, ny]) in terrain.nearest_one([x, y], 0.5, [[0.0; 2]; 2]) {
                        let out = if distance < 0.0 { 1e-5 - distance } else { 0.0 };
                        (x, y) = (x + out * nx, y + out * ny);
                    }
                }
                assert!(y > terrain.outline.height(x) - ON, "{ground:?}: {from:?} to {x} {y}");
                let moved = (x - from[0]).hypot(y - from[1]);
                assert!(moved < 0.05, "{ground:?}: {from:?} moved by {moved}");
            }
        }
    }
}
