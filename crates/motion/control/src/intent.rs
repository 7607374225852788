//! What a player, or a program, wants a character to do.

use ambulo_rig::glam::Vec2;

/// How to move. Standing follows from an asked speed near zero, jumping from a
/// [`crate::JumpArea`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gait {
    /// The default.
    #[default]
    Walk,
    /// Faster than walking, both feet off the ground for a moment.
    Jog,
    /// Faster yet. The published layout has one input for jogging and running: there it is `Jog`.
    Run,
    /// Knees bent, head low.
    Crouch,
    /// Walk, jog or run by the asked speed, mixed where they meet: walking turns into jogging from
    /// 1.9 to 2.3 m/s and jogging into running from 3.6 to 4.2 m/s.
    Auto,
}

/// Metres a second; more is a mistake of the caller's.
const FASTEST: f32 = 100.0;

/// Wishes for this moment; the world's frame, ground plane (x, z).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intent {
    /// Asked velocity, metres a second, at most 100. Below 6 cm/s it means standing.
    pub velocity: Vec2,
    /// Where to look while strafing, any length but zero; `None`: along the movement.
    pub facing: Option<Vec2>,
    /// 0: face where you go (or stay as you are); 1: face `facing` whatever the movement.
    pub strafe: f32,
    /// How to move.
    pub gait: Gait,
}

impl Intent {
    /// Whether every number can be used.
    pub fn is_valid(&self) -> bool {
        let facing = self.facing.is_none_or(|f| f.is_finite() && f.length_squared() > 1e-12);
        self.velocity.length() <= FASTEST && facing && (0.0..=1.0).contains(&self.strafe)
    }
}
