//! The laws of a world, as settings.

use serde::{Deserialize, Serialize};

use crate::Ground;

/// Who does the physics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Individuals in the lanes of a register.
    #[default]
    Lockstep,
    /// Box2D 3.
    Box2d,
}

/// Everything about a world but who lives in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Physics {
    /// Who does the physics.
    pub solver: Solver,
    /// Downward, metres a second², 0 to 100.
    pub gravity: f32,
    /// Steps a second, 10 to 1000.
    pub rate: f32,
    /// Sub-steps of a step, 1 to 32.
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
    /// Water all around, if any: creatures neither sink nor float in it, and start 2 m above the
    /// ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
}

/// Water that parts are dragged by: a part that moves across its width (or its height) at v is slowed
/// by the force ½ · density · drag · width · v², and its turning in the same way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Water {
    /// Kilograms a square metre, 0 to 10000.
    pub density: f32,
    /// Drag coefficient, 0 to 10.
    pub drag: f32,
}

impl Default for Water {
    /// As heavy as most creatures that ship.
    fn default() -> Self {
        Self { density: 40.0, drag: 1.2 }
    }
}

/// How far above the ground creatures start in water, metres.
pub(crate) const DEPTH: f32 = 2.0;

impl Default for Physics {
    fn default() -> Self {
        Self {
            solver: Solver::Lockstep,
            gravity: 9.81,
            rate: 60.0,
            substeps: 4,
            ground_friction: 0.8,
            friction_scale: 1.0,
            mass_scale: 1.0,
            torque_scale: 1.0,
            ground: Ground::Flat,
            water: None,
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
    /// Gravity that is felt, metres a second²: none in water.
    pub(crate) fn weight(&self) -> f32 {
        if self.water.is_some() { 0.0 } else { self.gravity }
    }

    /// How much water slows a part of that width and height, kilograms a metre along both, and its
    /// turning, kilograms times metres²: for the seconds of a step.
    pub(crate) fn drag(&self, [width, height]: [f32; 2]) -> [f32; 3] {
        let Some(Water { density, drag }) = self.water else { return [0.0; 3] };
        let share = 0.5 * density * drag * self.dt();
        // ∫ |x| x² dx over both sides, for either pair of sides.
        let turning = (width.powi(4) + height.powi(4)) / 32.0;
        [share * height, share * width, share * turning]
    }

    /// Seconds a step.
    pub fn dt(&self) -> f32 {
        1.0 / self.rate
    }

    /// Physics a little different: times those factors, as far as each may go.
    pub fn scaled(self, friction: f32, mass: f32, torque: f32, rate: f32) -> Self {
        Self {
            friction_scale: (self.friction_scale * friction).min(10.0),
            mass_scale: (self.mass_scale * mass).clamp(0.1, 10.0),
            torque_scale: (self.torque_scale * torque).min(10.0),
            rate: (self.rate * rate).clamp(10.0, 1000.0),
            ..self
        }
    }

    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), PhysicsError> {
        let water = self.water.unwrap_or_default();
        let fields = [
            ("water.density", water.density, [0.0, 1e4]),
            ("water.drag", water.drag, [0.0, 10.0]),
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
