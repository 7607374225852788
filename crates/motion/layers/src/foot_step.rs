//! A little step: how a foot that stands goes to where the motion stands.

use std::ops::{Add, Mul, Sub};

use ambulo_rig::glam::Vec3;
use ambulo_rig::wrapped;
use serde::{Deserialize, Serialize};

use crate::smooth::smoothstep;

/// Share of a step's time until which it follows a motion that moves on. After that the foot comes
/// down where it was aimed, as a person's does: it does not swerve just over the ground.
const AIMED: f32 = 0.7;

/// How feet that stand go to where the motion has them: in little steps, one foot after the other.
/// For poses that stand, laid over a character that stands otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StepSettings {
    /// A held foot takes a step when the motion has it this far away, metres; above 0 …
    pub off: f32,
    /// … or turned about the vertical by so much, radians; above 0.
    pub turned: f32,
    /// From lifting the foot to its landing, seconds.
    pub time: f32,
    /// How high it is lifted, metres …
    pub height: f32,
    /// … and how much higher for each metre that it goes.
    pub rise: f32,
    /// Takes the place of [`crate::FootSettings::leash`], since a foot may wait for the other one to
    /// land; metres, not less than `off`.
    pub leash: f32,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self { off: 0.04, turned: 0.35, time: 0.35, height: 0.04, rise: 0.15, leash: 0.6 }
    }
}

impl StepSettings {
    /// The first setting that cannot be used.
    pub(crate) fn bad(&self) -> Option<&'static str> {
        let Self { off, turned, time, height, rise, leash } = *self;
        let named = [
            ("off", off, f32::MIN_POSITIVE),
            ("turned", turned, f32::MIN_POSITIVE),
            ("time", time, 0.0),
            ("height", height, 0.0),
            ("rise", rise, 0.0),
            ("leash of the steps", leash, off),
        ];
        // Asked this way round, NaN is refused as well.
        let bad = |&&(_, number, least): &&(_, f32, f32)| !(number >= least && number.is_finite());
        named.iter().find(bad).map(|&(name, ..)| name)
    }
}

/// Where a foot stands or is to stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stand {
    /// Of its ball, metres.
    pub place: Vec3,
    /// The way that it points, radians about +Y, 0 along +Z.
    pub heading: f32,
}

/// A foot on its way.
///
/// Place and heading go along the cubic from where they are, at the speed that they have, to rest at
/// the aim when the time is over. As long as the aim stands still each frame finds the same cubic
/// again, whatever the frame rate; when it moves, neither place nor speed jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Seconds since the foot was lifted.
    time: f32,
    /// Without the arc.
    now: Stand,
    velocity: Vec3,
    turning: f32,
    aim: Stand,
    /// Of the arc, metres.
    height: f32,
}

impl Step {
    /// Lifts a foot; `over` is by how much the ground between rises above the straight way, metres.
    pub fn new(from: Stand, aim: Stand, over: f32, settings: &StepSettings) -> Self {
        let distance = (aim.place - from.place).with_y(0.0).length();
        let height = settings.height + settings.rise * distance + over;
        Self { time: 0.0, now: from, velocity: Vec3::ZERO, turning: 0.0, aim, height }
    }

    /// Moves the foot on; where it lands, if it does.
    pub fn advance(&mut self, aim: Stand, settings: &StepSettings, dt: f32) -> Option<Stand> {
        if self.time < AIMED * settings.time {
            self.aim = aim;
        }
        let left = settings.time - self.time;
        self.time += dt;
        if dt >= left {
            return Some(self.aim);
        }
        // The shorter way round.
        let heading = self.now.heading + wrapped(self.aim.heading - self.now.heading);
        let Stand { place, heading: from } = self.now;
        (self.now.place, self.velocity) = to_rest(place, self.velocity, self.aim.place, left, dt);
        (self.now.heading, self.turning) = to_rest(from, self.turning, heading, left, dt);
        None
    }

    /// Where the foot is shown.
    pub fn shown(&self, settings: &StepSettings) -> Stand {
        let s = self.share(settings);
        // Flat at both ends, 1 in the middle.
        let arc = 16.0 * (s * (1.0 - s)).powi(2);
        Stand { place: self.now.place + Vec3::Y * (self.height * arc), ..self.now }
    }

    /// How surely it is off the ground: 0 when it is lifted and when it lands, 1 in between.
    pub fn airborne(&self, settings: &StepSettings) -> f32 {
        let s = self.share(settings);
        smoothstep(0.0, 0.25, s) * smoothstep(0.0, 0.25, 1.0 - s)
    }

    fn share(&self, settings: &StepSettings) -> f32 {
        (self.time / settings.time.max(1e-6)).clamp(0.0, 1.0)
    }
}

/// Place and speed after `dt` on the cubic from `x`, at the speed `v`, to rest at `target` after
/// `left` seconds, of which `dt` is a part.
fn to_rest<T>(x: T, v: T, target: T, left: f32, dt: f32) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    let u = dt / left;
    let (away, rest) = (x - target, 1.0 - u);
    let place = target + (away * (1.0 + 2.0 * u) + v * dt) * (rest * rest);
    (place, (v * (1.0 - 3.0 * u) - away * (6.0 * u / left)) * rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SETTINGS: StepSettings =
        StepSettings { off: 0.04, turned: 0.35, time: 0.35, height: 0.04, rise: 0.15, leash: 0.6 };

    fn stand(x: f32, heading: f32) -> Stand {
        Stand { place: Vec3::new(x, 0.02, 0.0), heading }
    }

    #[test]
    fn it_starts_and_ends_at_rest_and_clears_the_ground() {
        let mut step = Step::new(stand(0.0, 3.0), stand(0.2, -3.0), 0.01, &SETTINGS);
        let (mut before, mut highest, mut fastest) = (step.shown(&SETTINGS), 0.0f32, [0.0f32; 2]);
        let mut frames = 0;
        let landed = loop {
            frames += 1;
            let landed = step.advance(stand(0.2, -3.0), &SETTINGS, 0.001);
            let now = landed.unwrap_or(step.shown(&SETTINGS));
            let moved = now.place.distance(before.place);
            // The shorter way round, over half a turn.
            let turned = wrapped(now.heading - before.heading).abs();
            assert!(moved < 0.0012 && turned < 0.0013, "{moved} {turned} in {frames}");
            let end = !(5..=345).contains(&frames);
            assert!(!end || moved < 1.5e-4, "{moved} in {frames}");
            fastest = [fastest[0].max(moved), fastest[1].max(turned)];
            highest = highest.max(now.place.y - 0.02);
            before = now;
            if let Some(landed) = landed {
                break landed;
            }
        };
        assert!((349..=351).contains(&frames), "{frames}");
        assert_eq!(landed, stand(0.2, -3.0));
        assert!((highest - 0.08).abs() < 1e-3, "{highest}");
        assert!(fastest[0] > 8e-4 && fastest[1] > 1e-3, "{fastest:?}");
    }

    #[test]
    fn no_time_is_a_jump_and_any_time_is_fine() {
        let at_once = StepSettings { time: 0.0, ..SETTINGS };
        let mut step = Step::new(stand(0.0, 0.0), stand(0.1, 0.0), 0.0, &at_once);
        assert!(step.shown(&at_once).place.is_finite());
        assert_eq!(step.advance(stand(0.1, 0.0), &at_once, 0.0), Some(stand(0.1, 0.0)));
        let mut step = Step::new(stand(0.0, 0.0), stand(0.1, 0.0), 0.0, &SETTINGS);
        assert_eq!(step.advance(stand(0.1, 0.0), &SETTINGS, 0.0), None);
        assert_eq!(step.shown(&SETTINGS), stand(0.0, 0.0));
        assert_eq!(step.advance(stand(0.3, 1.0), &SETTINGS, f32::MAX), Some(stand(0.3, 1.0)));
    }

    proptest! {
        #[test]
        fn two_parts_of_a_cubic_are_the_whole(
            x in -1.0..1.0f32, v in -2.0..2.0f32, left in 0.1..0.5f32, part in 0.05..0.45f32,
        ) {
            let dt = part * left;
            let (place, speed) = to_rest(x, v, 0.3, left, 2.0 * dt);
            let (half, half_speed) = to_rest(x, v, 0.3, left, dt);
            let (twice, twice_speed) = to_rest(half, half_speed, 0.3, left - dt, dt);
            prop_assert!((place - twice).abs() < 1e-5 && (speed - twice_speed).abs() < 1e-3);
        }
    }
}
