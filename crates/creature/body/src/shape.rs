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

    #[test]
    fn bounds_turn_with_the_part() {
        let capsule = Shape::Capsule { length: 2.0, radius: 0.5 };
        let [l, b, r, t] = capsule.bounds([1.0, 0.0], std::f32::consts::FRAC_PI_2);
        for (got, expected) in [(l, -0.5), (b, -0.5), (r, 2.5), (t, 0.5)] {
            assert!((got - expected).abs() < 1e-6, "{got} {expected}");
        }
    }
}
