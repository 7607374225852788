//! How quickly a character follows.

/// Time constants of a controller. Smoothing is given as half-lives in seconds, so that nothing
/// depends on a frame rate; the defaults are those of the published demo, whose per-frame blends
/// at 60 Hz they reproduce.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        }
    }
}

impl Tuning {
    /// The published demo's "responsive" setting: turns and starts sooner, slides a little more.
    pub fn responsive() -> Self {
        Self { position_bias: [2.0, 2.0], facing_bias: [5.0, 3.0], ..Self::default() }
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
        ];
        let biases = self.position_bias.iter().chain(&self.facing_bias);
        halflives.iter().all(|h| h.is_finite() && *h >= 0.0)
            && biases.clone().all(|b| b.is_finite() && *b > 0.0)
    }
}

/// Share of the way to a target that `dt` covers at a half-life; 1 at half-life 0.
pub fn share(halflife: f32, dt: f32) -> f32 {
    if halflife > 0.0 { 1.0 - (-std::f32::consts::LN_2 * dt / halflife).exp() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_the_published_blends() {
        let tuning = Tuning::default();
        let dt = 1.0 / 60.0;
        assert!((share(tuning.velocity_halflife, dt) - 0.9).abs() < 1e-5);
        assert!((share(tuning.gait_halflife, dt) - 0.1).abs() < 1e-5);
        assert!((share(tuning.pose_halflife, dt) - 0.5).abs() < 1e-5);
        assert_eq!(share(0.0, dt), 1.0);
        assert!(tuning.is_valid() && Tuning::responsive().is_valid());
        assert!(!Tuning { gait_halflife: f32::NAN, ..tuning }.is_valid());
    }
}
