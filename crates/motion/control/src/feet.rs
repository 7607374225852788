//! Feet that stay where they stand.
//!
//! The published run-time loop locks feet while their contact is sure and lets go slowly. Here the
//! ball of the foot is held, on the ground plane only: the heel may rise and the foot may turn
//! about it, as in a step.

use ambulo_rig::glam::Vec2;

use ambulo_rig::share;

/// A foot is held from this contact on …
const HOLD: f32 = 0.6;
/// … and let go below this one; in between it stays as it is.
const LET_GO: f32 = 0.4;
/// A foot that the body has left this far behind is let go, metres.
const LEASH: f32 = 0.1;
/// Half-life in seconds by which a held foot creeps to where the network has it: nothing within a
/// step, but whoever stands ends in the network's stance.
const CREEP: f32 = 1.0;

/// Whether one foot is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Grip {
    #[default]
    Free,
    Held(Vec2),
    /// Left behind while in contact: not held again before it has been off the ground.
    Lost,
}

/// How one foot is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    grip: Grip,
    shift: Vec2,
}

impl Hold {
    /// How far to shift a foot whose ball the network puts at `ball` with this contact (0 to 1), so
    /// that it stays where it was held; what is left of a shift after letting go fades by
    /// `halflife`.
    pub fn shift(&mut self, ball: Vec2, contact: f32, halflife: f32, dt: f32) -> Vec2 {
        self.shift -= self.shift * share(halflife, dt);
        self.grip = match self.grip {
            _ if contact < LET_GO => Grip::Free,
            // Taking hold where the foot is shown, not where the network has it, leaves no jump.
            Grip::Free if contact >= HOLD => Grip::Held(ball + self.shift),
            Grip::Held(place) if place.distance(ball) >= LEASH => Grip::Lost,
            Grip::Held(place) => Grip::Held(place.lerp(ball, share(CREEP, dt))),
            grip => grip,
        };
        if let Grip::Held(place) = self.grip {
            self.shift = place - ball;
        }
        self.shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 1.0 / 60.0;

    #[test]
    fn a_foot_in_contact_stays_and_comes_back_smoothly() {
        let mut hold = Hold::default();
        let ball = |frame: usize| Vec2::new(0.0, 0.001 * frame as f32);
        assert_eq!(hold.shift(ball(0), 0.5, 0.05, DT), Vec2::ZERO, "not sure enough yet");
        let start = ball(1);
        for frame in 1..40 {
            // Contact that wavers around one half does not flicker once a foot is held.
            let contact = if frame % 2 == 0 { 0.45 } else { 0.9 };
            let shown = ball(frame) + hold.shift(ball(frame), contact, 0.05, DT);
            let slid = shown.distance(start);
            assert!(slid < 0.01, "slid {slid} of {} m in frame {frame}", ball(frame).y);
        }
        let mut before = ball(39) + hold.shift(ball(39), 0.9, 0.05, DT);
        for frame in 40..100 {
            let shown = ball(frame) + hold.shift(ball(frame), 0.0, 0.05, DT);
            assert!(shown.distance(before) < 0.02, "jumped");
            before = shown;
        }
        assert!(before.distance(ball(99)) < 1e-4, "back where the network has it");
    }

    #[test]
    fn who_stands_ends_in_the_networks_stance() {
        let mut hold = Hold::default();
        hold.shift(Vec2::ZERO, 1.0, 0.05, DT);
        let stance = Vec2::new(0.08, 0.0);
        let early = (0..6).map(|_| hold.shift(stance, 1.0, 0.05, DT)).last().unwrap();
        let late = (0..600).map(|_| hold.shift(stance, 1.0, 0.05, DT)).last().unwrap();
        assert!(early.length() > 0.07 && late.length() < 1e-3, "{early} {late}");
    }

    #[test]
    fn a_foot_left_behind_is_let_go() {
        let mut hold = Hold::default();
        let mut largest = 0.0f32;
        for frame in 0..100 {
            let ball = Vec2::new(0.03 * frame as f32, 0.0);
            let shift = hold.shift(ball, 1.0, 0.05, DT);
            largest = largest.max(shift.length());
            assert!(frame < 60 || shift.length() < 1e-3, "not held again while in contact");
        }
        assert!(largest > 0.8 * LEASH && largest < LEASH, "{largest}");
        hold.shift(Vec2::ZERO, 0.1, 0.05, DT);
        hold.shift(Vec2::ZERO, 0.9, 0.05, DT);
        let again = hold.shift(Vec2::new(0.01, 0.0), 0.9, 0.05, DT);
        assert!((again.x + 0.01).abs() < 1e-3, "held again after a step: {again}");
    }
}
