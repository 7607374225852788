//! Areas, centres and extents of outlines.

use crate::Shape;

/// Corners of `points` in counter-clockwise order.
fn counter_clockwise(points: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let mut points = points.to_vec();
    if signed_area(&points) < 0.0 {
        points.reverse();
    }
    points
}

fn signed_area(points: &[[f32; 2]]) -> f32 {
    0.5 * edges(points).map(|([ax, ay], [bx, by])| ax * by - ay * bx).sum::<f32>()
}

fn edges(points: &[[f32; 2]]) -> impl Iterator<Item = ([f32; 2], [f32; 2])> + '_ {
    let count = points.len();
    (0..count).map(move |i| (points[i], points[(i + 1) % count]))
}

impl Shape {
    /// Square metres.
    pub fn area(&self) -> f32 {
        let pi = std::f32::consts::PI;
        match self {
            Shape::Box { width, height } => width * height,
            Shape::Circle { radius } => pi * radius * radius,
            Shape::Capsule { length, radius } => pi * radius * radius + 2.0 * radius * length,
            Shape::Polygon { points } => signed_area(points).abs(),
        }
    }

    /// Centre of mass in the part's frame, metres.
    pub fn centre(&self) -> [f32; 2] {
        let Shape::Polygon { points } = self else { return [0.0, 0.0] };
        let area = signed_area(points);
        let sum = edges(points).fold([0.0, 0.0], |[x, y], ([ax, ay], [bx, by])| {
            let cross = ax * by - ay * bx;
            [x + (ax + bx) * cross, y + (ay + by) * cross]
        });
        sum.map(|v| v / (6.0 * area))
    }

    /// Second moment of area about the centre of mass, metres⁴: times the density it is the moment of
    /// inertia.
    pub fn second_moment(&self) -> f32 {
        let pi = std::f32::consts::PI;
        match self {
            Shape::Box { width: w, height: h } => w * h * (w * w + h * h) / 12.0,
            Shape::Circle { radius: r } => 0.5 * pi * r * r * r * r,
            Shape::Capsule { length, radius: r } => {
                let middle = 2.0 * r * length * (length * length + 4.0 * r * r) / 12.0;
                // Each half circle: about its own centroid, which is `off` from its flat side, and
                // from there to the middle.
                let (area, off) = (0.5 * pi * r * r, 4.0 * r / (3.0 * pi));
                let own = 0.25 * pi * r * r * r * r - area * off * off;
                middle + 2.0 * (own + area * (0.5 * length + off).powi(2))
            }
            Shape::Polygon { points } => {
                let [cx, cy] = self.centre();
                let points: Vec<_> = points.iter().map(|[x, y]| [x - cx, y - cy]).collect();
                let sum: f32 = edges(&points)
                    .map(|([ax, ay], [bx, by])| {
                        let square = ax * ax + ay * ay + ax * bx + ay * by + bx * bx + by * by;
                        (ax * by - ay * bx) * square
                    })
                    .sum();
                sum.abs() / 12.0
            }
        }
    }

    /// The same outline, so many times as large.
    pub fn scaled(&self, by: f32) -> Shape {
        match self {
            Shape::Box { width, height } => Shape::Box { width: by * width, height: by * height },
            Shape::Circle { radius } => Shape::Circle { radius: by * radius },
            Shape::Capsule { length, radius } => {
                Shape::Capsule { length: by * length, radius: by * radius }
            }
            Shape::Polygon { points } => {
                Shape::Polygon { points: points.iter().map(|[x, y]| [by * x, by * y]).collect() }
            }
        }
    }

    /// Corners around which the outline lies, counter-clockwise, and its distance from their hull:
    /// a circle is one point with its radius.
    pub fn hull(&self) -> (Vec<[f32; 2]>, f32) {
        match self {
            Shape::Box { width, height } => {
                let (w, h) = (0.5 * width, 0.5 * height);
                (vec![[-w, -h], [w, -h], [w, h], [-w, h]], 0.0)
            }
            Shape::Circle { radius } => (vec![[0.0, 0.0]], *radius),
            Shape::Capsule { length, radius } => {
                (vec![[0.0, -0.5 * length], [0.0, 0.5 * length]], *radius)
            }
            Shape::Polygon { points } => (counter_clockwise(points), 0.0),
        }
    }

    /// Width and height in the part's own frame, metres.
    pub fn extent(&self) -> [f32; 2] {
        let [l, b, r, t] = self.bounds([0.0, 0.0], 0.0);
        [r - l, t - b]
    }

    /// Least x, least y, greatest x, greatest y of the outline at a place, metres.
    pub fn bounds(&self, position: [f32; 2], angle: f32) -> [f32; 4] {
        let (sin, cos) = libm::sincosf(angle);
        let (points, radius) = self.hull();
        let start = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
        points.iter().fold(start, |[l, b, r, t], [px, py]| {
            let (x, y) = (position[0] + cos * px - sin * py, position[1] + sin * px + cos * py);
            [l.min(x - radius), b.min(y - radius), r.max(x + radius), t.max(y + radius)]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_measured_either_way_around() {
        let mut points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        for _ in 0..2 {
            let shape = Shape::Polygon { points: points.clone() };
            assert!((shape.area() - 2.0).abs() < 1e-6);
            let centre = shape.centre();
            assert!((centre[0] - 1.0).abs() < 1e-6 && (centre[1] - 0.5).abs() < 1e-6);
            assert!(signed_area(&shape.hull().0) > 0.0);
            points.reverse();
        }
    }

    /// Summed over a fine grid of points inside.
    #[test]
    fn second_moments_are_those_of_the_outlines() {
        let capsule = Shape::Capsule { length: 0.6, radius: 0.2 };
        let inside_capsule = |x: f32, y: f32| x * x + (y.abs() - 0.3).max(0.0).powi(2) <= 0.04;
        let triangle = Shape::Polygon { points: vec![[0.0, 0.0], [0.9, 0.0], [0.0, 0.6]] };
        let inside_triangle = |x: f32, y: f32| {
            let (x, y) = (x + 0.3, y + 0.2);
            x >= 0.0 && y >= 0.0 && x / 0.9 + y / 0.6 <= 1.0
        };
        let box_ = Shape::Box { width: 0.8, height: 0.5 };
        let circle = Shape::Circle { radius: 0.4 };
        type Inside<'a> = &'a dyn Fn(f32, f32) -> bool;
        let cases: [(&Shape, Inside<'_>); 4] = [
            (&capsule, &inside_capsule),
            (&triangle, &inside_triangle),
            (&box_, &|x, y| x.abs() <= 0.4 && y.abs() <= 0.25),
            (&circle, &|x, y| x * x + y * y <= 0.16),
        ];
        for (shape, inside) in cases {
            let cell = 2e-3f32;
            let mut sum = 0.0;
            for i in -500..500 {
                for j in -500..500 {
                    let (x, y) = ((i as f32 + 0.5) * cell, (j as f32 + 0.5) * cell);
                    if inside(x, y) {
                        sum += f64::from((x * x + y * y) * cell * cell);
                    }
                }
            }
            let got = f64::from(shape.second_moment());
            assert!((got / sum - 1.0).abs() < 0.01, "{shape:?}: {got} and {sum}");
        }
    }

    #[test]
    fn bounds_turn_with_the_part() {
        let capsule = Shape::Capsule { length: 2.0, radius: 0.5 };
        let [l, b, r, t] = capsule.bounds([1.0, 0.0], std::f32::consts::FRAC_PI_2);
        for (got, expected) in [(l, -0.5), (b, -0.5), (r, 2.5), (t, 0.5)] {
            assert!((got - expected).abs() < 1e-6, "{got} {expected}");
        }
    }
}
