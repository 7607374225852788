//! Shapes of the ground, as a chain of segments.

use serde::{Deserialize, Serialize};

/// How far the ground reaches to both sides, metres.
const REACH: f32 = 1000.0;
/// Where anything but flat ground begins, metres: creatures start on the level.
const BEGIN: f32 = 3.0;
/// Depth of a hole, metres: nothing climbs out.
const DEPTH: f32 = 5.0;

/// What creatures stand on; level where they start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ground {
    /// Level.
    #[default]
    Flat,
    /// Up or down from 3 m on.
    Slope {
        /// Radians, -1 to 1.
        angle: f32,
    },
    /// A stair up or down from 3 m on.
    Steps {
        /// Of a step, metres, -1 to 1.
        height: f32,
        /// From one step to the next, metres, 0.1 to 20.
        length: f32,
    },
    /// Holes to jump over from 3 m on, 5 m deep.
    Holes {
        /// Metres, 0.05 to 5.
        width: f32,
        /// From the end of one to the begin of the next, metres, 0.5 to 50.
        between: f32,
    },
    /// Blocks to get over from 3 m on.
    Hurdles {
        /// Metres, 0.01 to 2.
        height: f32,
        /// How thick they are, metres, 0.02 to 5.
        width: f32,
        /// From the end of one to the begin of the next, metres, 0.5 to 50.
        between: f32,
    },
    /// Uneven from 3 m on.
    Rough {
        /// The most that a corner is off the level, metres, 0 to 1.
        height: f32,
        /// From corner to corner, metres, 0.2 to 20.
        spacing: f32,
        /// Another seed makes other ground of the same kind.
        seed: u64,
    },
}

impl Ground {
    /// What is out of range, if anything: the field of [`Physics`](crate::Physics), what it is, what
    /// it must be.
    pub(crate) fn problem(&self) -> Option<(&'static str, f32, [f32; 2])> {
        let fields = match *self {
            Ground::Flat => vec![],
            Ground::Slope { angle } => vec![("ground.angle", angle, [-1.0, 1.0])],
            Ground::Steps { height, length } => {
                vec![("ground.height", height, [-1.0, 1.0]), ("ground.length", length, [0.1, 20.0])]
            }
            Ground::Holes { width, between } => {
                vec![("ground.width", width, [0.05, 5.0]), ("ground.between", between, [0.5, 50.0])]
            }
            Ground::Hurdles { height, width, between } => vec![
                ("ground.height", height, [0.01, 2.0]),
                ("ground.width", width, [0.02, 5.0]),
                ("ground.between", between, [0.5, 50.0]),
            ],
            Ground::Rough { height, spacing, .. } => {
                vec![
                    ("ground.height", height, [0.0, 1.0]),
                    ("ground.spacing", spacing, [0.2, 20.0]),
                ]
            }
        };
        fields.into_iter().find(|(_, value, [low, high])| !(*low..=*high).contains(value))
    }

    /// Its outline.
    pub fn outline(&self) -> Outline {
        let mut points = vec![[-REACH, 0.0]];
        match *self {
            Ground::Flat => points.push([REACH, 0.0]),
            Ground::Slope { angle } => {
                points.push([BEGIN, 0.0]);
                points.push([REACH, (REACH - BEGIN) * libm::tanf(angle)]);
            }
            Ground::Steps { height, length } => {
                let count = ((REACH - BEGIN) / length) as usize;
                for step in 0..count {
                    let x = BEGIN + step as f32 * length;
                    points.push([x, step as f32 * height]);
                    points.push([x, (step + 1) as f32 * height]);
                }
                points.push([REACH, count as f32 * height]);
            }
            Ground::Holes { width, between } => blocks(&mut points, -DEPTH, width, between),
            Ground::Hurdles { height, width, between } => {
                blocks(&mut points, height, width, between);
            }
            Ground::Rough { height, spacing, seed } => {
                points.push([BEGIN, 0.0]);
                let mut state = seed;
                let mut x = BEGIN + spacing;
                while x < REACH {
                    points.push([x, height * uniform(&mut state)]);
                    x += spacing;
                }
                points.push([REACH, 0.0]);
            }
        }
        Outline(points)
    }
}

/// Stretches of the same width that are so much higher than the rest.
fn blocks(points: &mut Vec<[f32; 2]>, height: f32, width: f32, between: f32) {
    let mut x = BEGIN;
    while x + width < REACH {
        let end = x + width;
        points.extend([[x, 0.0], [x, height], [end, height], [end, 0.0]]);
        x = end + between;
    }
    points.push([REACH, 0.0]);
}

/// Uniform in [-1, 1): SplitMix64 (Steele, Lea, Flood 2014).
fn uniform(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
}

/// The ground's line from left to right; upright stretches are walls.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline(Vec<[f32; 2]>);

impl Outline {
    /// Its corners, metres.
    pub fn points(&self) -> &[[f32; 2]] {
        &self.0
    }

    /// Height at `x`, metres; on a wall that of its right side; level beyond the ends.
    pub fn height(&self, x: f32) -> f32 {
        let after = self.0.partition_point(|point| point[0] <= x);
        match (after.checked_sub(1).map(|i| self.0[i]), self.0.get(after)) {
            (Some([ax, ay]), Some([bx, by])) => ay + (by - ay) * ((x - ax) / (bx - ax)),
            (Some([_, y]), None) => y,
            (None, _) => self.0[0][1],
        }
    }

    /// The greatest height from `left` to `right`.
    pub fn highest(&self, left: f32, right: f32) -> f32 {
        let inside = self.0.iter().filter(|point| (left..=right).contains(&point[0]));
        let ends = [self.height(left), self.height(right)];
        inside.map(|point| point[1]).chain(ends).fold(f32::NEG_INFINITY, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_level_where_creatures_start_and_goes_from_left_to_right() {
        let kinds = [
            Ground::Flat,
            Ground::Slope { angle: 0.2 },
            Ground::Steps { height: 0.1, length: 0.5 },
            Ground::Holes { width: 0.4, between: 3.0 },
            Ground::Hurdles { height: 0.2, width: 0.3, between: 2.0 },
            Ground::Rough { height: 0.2, spacing: 0.5, seed: 1 },
        ];
        for ground in kinds {
            let outline = ground.outline();
            assert!(outline.points().windows(2).all(|w| w[0][0] <= w[1][0]), "{ground:?}");
            assert!([-900.0, 0.0, 2.9].iter().all(|&x| outline.height(x) == 0.0), "{ground:?}");
            assert_eq!(ground.problem(), None);
        }
        let stair = Ground::Steps { height: 0.1, length: 0.5 }.outline();
        assert!(
            (stair.height(3.7) - 0.2).abs() < 1e-5 && (stair.highest(2.0, 3.2) - 0.1).abs() < 1e-5
        );
        assert_eq!(Ground::Holes { width: 0.4, between: 3.0 }.outline().height(3.2), -DEPTH);
        let hurdles = Ground::Hurdles { height: 0.2, width: 0.3, between: 2.0 }.outline();
        assert!(hurdles.height(3.1) == 0.2 && hurdles.height(3.4) == 0.0);
        assert!(hurdles.height(5.4) == 0.2, "the next one");
        let rough = |seed| Ground::Rough { height: 0.2, spacing: 0.5, seed }.outline();
        assert!(rough(1) == rough(1) && rough(1) != rough(2));
        assert!(rough(1).points().iter().all(|p| p[1].abs() <= 0.2));
    }
}
