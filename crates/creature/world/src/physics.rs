//! The laws of a world, as settings.

use serde::{Deserialize, Serialize};

use crate::Ground;

/// Everything about a world but who lives in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Physics {
    /// Downward, metres a second², 0 to 100.
    pub gravity: f32,
    /// Steps a second, 10 to 1000.
    pub rate: f32,
    /// Box2D's sub-steps of a step, 1 to 32.
    pub substeps: u32,
    /// Coulomb friction of the ground, 0 to 10; with a part's own the geometric mean counts.
    pub ground_friction: f32,
    /// Times the friction of parts and ground, 0 to 10.
    pub friction_scale: f32,
    /// Times the mass of every part, 0.1 to 10.
    pub mass_scale: f32,
    /// Times the torque of every motor, 0 to 10.
    pub torque_scale: f32,
    /// Shape of the ground.
    pub ground: Ground,
}

impl Default for Physics {
    fn default() -> Self {
        Self {
            gravity: 9.81,
            rate: 60.0,
            substeps: 4,
            ground_friction: 0.8,
            friction_scale: 1.0,
            mass_scale: 1.0,
            torque_scale: 1.0,
            ground: Ground::Flat,
        }
    }
}

/// A setting that is out of range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {value} is not {} to {}", .range[0], .range[1])]
pub struct PhysicsError {
    /// Its name.
    pub field: &'static str,
    /// What it is.
    pub value: f32,
    /// Least and greatest that it may be.
    pub range: [f32; 2],
}

impl Physics {
    /// Seconds a step.
    pub fn dt(&self) -> f32 {
        1.0 / self.rate
    }

    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), PhysicsError> {
        let fields = [
            ("gravity", self.gravity, [0.0, 100.0]),
            ("rate", self.rate, [10.0, 1000.0]),
            ("substeps", self.substeps as f32, [1.0, 32.0]),
            ("ground_friction", self.ground_friction, [0.0, 10.0]),
            ("friction_scale", self.friction_scale, [0.0, 10.0]),
            ("mass_scale", self.mass_scale, [0.1, 10.0]),
            ("torque_scale", self.torque_scale, [0.0, 10.0]),
        ];
        let bad =
            fields.into_iter().find(|(_, value, [low, high])| !(*low..=*high).contains(value));
        match bad.or_else(|| self.ground.problem()) {
            Some((field, value, range)) => Err(PhysicsError { field, value, range }),
            None => Ok(()),
        }
    }
}
