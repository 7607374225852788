//! A standing character is never still: its weight wanders between its feet.
//!
//! Asked for nothing, a network that feeds on its own pose comes to rest. What moves people who
//! stand is not in its input, so it is given here: a slow wish of the root around the place where
//! the standing began, to which the network answers with the whole body, as it learned from people.
//! The place also keeps a standing character from drifting away.

use std::f32::consts::TAU;

use ambulo_rig::glam::{Vec2, Vec3};

/// Sway to the side: frequency in hertz, share of the amplitude, and phase. Postural sway lies
/// below 1 Hz and falls with frequency (Winter, "Human balance and posture control", 1995).
const ASIDE: [(f32, f32, f32); 3] = [(0.13, 0.75, 0.0), (0.31, 0.45, 1.3), (0.53, 0.2, 4.1)];
/// The same forward and back, about half as far.
const AHEAD: [(f32, f32, f32); 3] = [(0.11, 0.3, 2.2), (0.27, 0.25, 0.4), (0.61, 0.12, 5.0)];
/// Seconds in which a character goes back to where it stands.
const SETTLE: f32 = 0.7;
/// How far a joint is told to be from where it is, as a share of the amplitude.
const STIR: f32 = 0.2;

/// How a character stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Idle {
    /// Seconds of its life.
    clock: f64,
    /// Where it stands and faces, if it does.
    place: Option<(Vec2, Vec2)>,
}

/// What the root of a standing character should do from now on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    clock: f64,
    facing: Vec2,
    /// From the root to where it should be now.
    off: Vec2,
    amplitude: f32,
}

impl Idle {
    /// Goes on by `dt`; answers while the character stands (`stands`) and sways at all.
    pub fn follow(
        &mut self,
        stands: bool,
        here: Vec2,
        facing: Vec2,
        amplitude: f32,
        dt: f32,
    ) -> Option<Wish> {
        self.clock += f64::from(dt);
        if !stands || amplitude <= 0.0 {
            self.place = None;
            return None;
        }
        let clock = self.clock;
        // Standing begins in the middle of a sway, not at its edge.
        let sway = |facing: Vec2| sway(clock, facing) * amplitude;
        let (place, facing) = *self.place.get_or_insert((here - sway(facing), facing));
        Some(Wish { clock, facing, off: place + sway(facing) - here, amplitude })
    }
}

impl Wish {
    /// Velocity wished for `ahead` seconds from now, metres a second.
    pub fn velocity(&self, ahead: f32) -> Vec2 {
        let swaying = sway_velocity(self.clock + f64::from(ahead), self.facing) * self.amplitude;
        swaying + self.off * ((-ahead / SETTLE).exp() / SETTLE)
    }

    /// A slow stir of one joint, metres: told to the network as part of its own pose, to which it
    /// answers with some pose near by.
    pub fn stir(&self, joint: usize) -> Vec3 {
        // Multiples of the golden ratio: no two joints stir alike.
        let shift = |axis: usize| ((3 * joint + axis) as f32 * 0.618_034).fract();
        let wave = |axis: usize| {
            let hertz = 0.15 + 0.45 * shift(axis + 7);
            ((self.clock * f64::from(hertz)).fract() as f32 + shift(axis)) * TAU
        };
        Vec3::from_array(std::array::from_fn(|axis| wave(axis).sin())) * (STIR * self.amplitude)
    }
}

fn sway(clock: f64, facing: Vec2) -> Vec2 {
    turned(waves(&ASIDE, clock, |at, _| at.sin()), waves(&AHEAD, clock, |at, _| at.sin()), facing)
}

fn sway_velocity(clock: f64, facing: Vec2) -> Vec2 {
    let rate = |at: f32, rate: f32| at.cos() * rate;
    turned(waves(&ASIDE, clock, rate), waves(&AHEAD, clock, rate), facing)
}

fn waves(table: &[(f32, f32, f32)], clock: f64, wave: impl Fn(f32, f32) -> f32) -> f32 {
    let one = |&(hertz, share, shift): &(f32, f32, f32)| {
        // Whole turns off in f64: a character may live for days.
        let at = (clock * f64::from(hertz)).fract() as f32 * TAU + shift;
        share * wave(at, TAU * hertz)
    };
    table.iter().map(one).sum()
}

fn turned(aside: f32, ahead: f32, facing: Vec2) -> Vec2 {
    Vec2::new(facing.y, -facing.x) * aside + facing * ahead
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 1.0 / 60.0;

    #[test]
    fn who_does_as_wished_sways_about_one_place() {
        let (mut idle, mut here, mut farthest) = (Idle::default(), Vec2::new(3.0, 1.0), 0.0f32);
        for _ in 0..60 * 120 {
            let wish = idle.follow(true, here, Vec2::X, 0.02, DT).unwrap();
            here += wish.velocity(0.0) * DT;
            farthest = farthest.max(here.distance(Vec2::new(3.0, 1.0)));
        }
        assert!(farthest > 0.01 && farthest < 0.07, "{farthest}");
    }

    #[test]
    fn who_is_pushed_away_is_called_back() {
        let mut idle = Idle::default();
        idle.follow(true, Vec2::ZERO, Vec2::Y, 0.02, DT).unwrap();
        let wish = idle.follow(true, Vec2::new(0.3, 0.0), Vec2::Y, 0.02, DT).unwrap();
        assert!(wish.velocity(0.0).x < -0.3 && wish.velocity(3.0).x > -0.1);
        assert_eq!(idle.follow(false, Vec2::ZERO, Vec2::Y, 0.02, DT), None);
        assert_eq!(idle.follow(true, Vec2::ZERO, Vec2::Y, 0.0, DT), None);
    }
}
