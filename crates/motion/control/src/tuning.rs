//! How quickly a character follows.

use serde::{Deserialize, Serialize};

/// Time constants of a controller. Smoothing is given as half-lives in seconds, so that nothing
/// depends on a frame rate; the defaults are those of the published demo, whose per-frame blends
/// at 60 Hz they reproduce.
///
/// A bundle may carry the tuning that its network moves best with, as its part `tuning`: an object
/// of these fields, of which those left out have the defaults.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tuning {
    /// Of the asked velocity (published: 0.9 a frame).
    pub velocity_halflife: f32,
    /// Of the asked facing (0.9 a frame).
    pub facing_halflife: f32,
    /// Of the strafe amount (0.9 a frame).
    pub strafe_halflife: f32,
    /// Of crouching (0.9 a frame).
    pub crouch_halflife: f32,
    /// Of the gait inputs (0.1 a frame).
    pub gait_halflife: f32,
    /// Of the pose fed back, around where its own velocity would take it (0.5 a frame).
    pub pose_halflife: f32,
    /// Hold feet where they stand, and keep them above the ground, in the shown pose.
    pub hold_feet: bool,
    /// Of the way back after a foot is let go (0.075 a frame, linear).
    pub foot_halflife: f32,
    /// Bends the future trajectory towards the asked velocity: share 1 − (1 − t)^bias at t of the
    /// window; without strafe, with strafe.
    pub position_bias: [f32; 2],
    /// The same for the facing.
    pub facing_bias: [f32; 2],
    /// Of what is left between the asked and the reached speed, by which the speed that the
    /// trajectory is given is raised or lowered; the speed reached is itself smoothed by a quarter
    /// of it. Without effect while `speed_limit` is 1 to 1.
    pub speed_halflife: f32,
    /// Least and greatest factor on the asked speed; both 1 (as published): no such correction.
    pub speed_limit: [f32; 2],
    /// How freely a standing character moves its root and its phase: 0 (as published) stops both,
    /// so that it freezes; 1 lets it breathe and shift its weight as its network foresees.
    pub stand_freedom: f32,
    /// No joint of the shown pose turns faster, radians a second: a jump of the network's is spread
    /// over some frames. 0 (as published): no limit. A person's fastest joints reach about 35.
    pub fastest_turn: f32,
    /// Share of a planted foot's slide that is taken off the root's movement: 0 (as published) moves
    /// the root as the network says, 1 as its feet do.
    pub foot_drive: f32,
    /// How far a standing character's root is asked to wander about its place, metres; 0 (as
    /// published): not at all.
    pub sway: f32,
}

impl Default for Tuning {
    fn default() -> Self {
        let blend_a_frame = |share: f32| -std::f32::consts::LN_2 / 60.0 / (1.0 - share).ln();
        Self {
            velocity_halflife: blend_a_frame(0.9),
            facing_halflife: blend_a_frame(0.9),
            strafe_halflife: blend_a_frame(0.9),
            crouch_halflife: blend_a_frame(0.9),
            gait_halflife: blend_a_frame(0.1),
            pose_halflife: blend_a_frame(0.5),
            hold_feet: true,
            foot_halflife: 0.075,
            position_bias: [0.5, 1.0],
            facing_bias: [2.0, 0.5],
            speed_halflife: 1.0,
            speed_limit: [1.0, 1.0],
            stand_freedom: 0.0,
            fastest_turn: 0.0,
            foot_drive: 0.0,
            sway: 0.0,
        }
    }
}

impl Tuning {
    /// The same with the published demo's "responsive" setting: turns and starts sooner, slides a
    /// little more. It bends the future sooner than this tuning by as much as the demo's does than
    /// its usual one.
    #[must_use]
    pub fn responsive(self) -> Self {
        let ([plain, strafing], [ahead, aside]) = (self.position_bias, self.facing_bias);
        Self {
            position_bias: [4.0 * plain, 2.0 * strafing],
            facing_bias: [2.5 * ahead, 6.0 * aside],
            ..self
        }
    }

    /// Whether every number can be used.
    pub fn is_valid(&self) -> bool {
        let halflives = [
            self.velocity_halflife,
            self.facing_halflife,
            self.strafe_halflife,
            self.crouch_halflife,
            self.gait_halflife,
            self.pose_halflife,
            self.foot_halflife,
            self.speed_halflife,
            self.fastest_turn,
        ];
        let [least, most] = self.speed_limit;
        let biases = self.position_bias.iter().chain(&self.facing_bias);
        halflives.iter().all(|h| h.is_finite() && *h >= 0.0)
            && biases.clone().all(|b| b.is_finite() && *b > 0.0)
            && (least > 0.0 && least <= 1.0 && (1.0..=MOST).contains(&most))
            && (0.0..=1.0).contains(&self.stand_freedom)
            && (0.0..=1.0).contains(&self.foot_drive)
            && (0.0..=MOST_SWAY).contains(&self.sway)
    }
}

/// Greatest factor on the asked speed that makes sense; more is a mistake.
const MOST: f32 = 10.0;

/// Nobody stands and wanders farther, metres.
const MOST_SWAY: f32 = 0.2;

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::share;

    #[test]
    fn defaults_are_the_published_blends() {
        let tuning = Tuning::default();
        let dt = 1.0 / 60.0;
        assert!((share(tuning.velocity_halflife, dt) - 0.9).abs() < 1e-5);
        assert!((share(tuning.gait_halflife, dt) - 0.1).abs() < 1e-5);
        assert!((share(tuning.pose_halflife, dt) - 0.5).abs() < 1e-5);
        assert_eq!(share(0.0, dt), 1.0);
        let quick = tuning.responsive();
        assert!(tuning.is_valid() && quick.is_valid());
        assert_eq!((quick.position_bias, quick.facing_bias), ([2.0, 2.0], [5.0, 3.0]));
    }

    #[test]
    fn numbers_that_cannot_be_used_are_told() {
        let tuning = Tuning::default();
        let limit = |speed_limit| Tuning { speed_limit, ..tuning };
        for bad in [
            Tuning { gait_halflife: f32::NAN, ..tuning },
            Tuning { speed_halflife: -1.0, ..tuning },
            Tuning { stand_freedom: 1.5, ..tuning },
            Tuning { sway: -0.1, ..tuning },
            Tuning { position_bias: [0.0, 1.0], ..tuning },
            limit([1.1, 1.3]),
            limit([0.8, 0.9]),
            limit([0.0, 1.3]),
            limit([0.8, f32::INFINITY]),
            limit([f32::NAN, 1.0]),
        ] {
            assert!(!bad.is_valid(), "{bad:?}");
        }
        assert!(limit([0.8, 1.3]).is_valid());
    }

    #[test]
    fn a_bundle_names_only_what_differs() {
        let read = |json: &str| serde_json::from_str::<Tuning>(json);
        assert_eq!(read("{}").unwrap(), Tuning::default());
        let some = read(r#"{"speed_limit": [0.8, 1.3], "stand_freedom": 1}"#).unwrap();
        let (speed_limit, stand_freedom) = ([0.8, 1.3], 1.0);
        assert_eq!(some, Tuning { speed_limit, stand_freedom, ..Tuning::default() });
        assert_eq!(read(&serde_json::to_string(&some).unwrap()).unwrap(), some);
        let error = read(r#"{"speed_gain": 1}"#).unwrap_err().to_string();
        assert!(error.contains("unknown field `speed_gain`"), "{error}");
    }
}
