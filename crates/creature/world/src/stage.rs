//! What a task and a controller need of a world, whoever moves it.

use ambulo_lanes::{Lanes, Mask, Simd};

use crate::{Outline, Pose, WorldError};

/// Groups of individuals, each as many as there are lanes.
///
/// Metres, kilograms, seconds, radians; x forward, y up, angles counter-clockwise.
pub trait Stage<S: Simd> {
    /// How many groups there are.
    fn groups(&self) -> usize;

    /// Seconds a step.
    fn dt(&self) -> Lanes<S>;

    /// The ground's line.
    fn ground(&self) -> &Outline;

    /// Asks a joint's motor for a speed, radians a second; it holds until the next call.
    ///
    /// # Errors
    /// A speed that is not finite, if the engine minds.
    fn set_motor(&mut self, group: usize, joint: usize, speed: Lanes<S>) -> Result<(), WorldError>;

    /// One step.
    ///
    /// # Errors
    /// A state that is no longer finite, if the engine minds.
    fn step(&mut self) -> Result<(), WorldError>;

    /// Where a part's centre of mass is, metres.
    fn centre(&self, group: usize, part: usize) -> [Lanes<S>; 2];

    /// How far a part has turned from the start pose, radians, −π to π.
    fn turned(&self, group: usize, part: usize) -> Lanes<S>;

    /// How far a joint has turned from the start pose, radians, −π to π.
    fn joint_angle(&self, group: usize, joint: usize) -> Lanes<S>;

    /// Whether a part touches the ground.
    fn touches(&self, group: usize, part: usize) -> Mask<S>;

    /// What a joint's motor gave in the last step, newton metres.
    ///
    /// # Errors
    /// A refusal of the engine.
    fn motor_torque(&mut self, group: usize, joint: usize) -> Result<Lanes<S>, WorldError>;

    /// Changes the speed of a part at once, metres a second.
    ///
    /// # Errors
    /// A change that is not finite, if the engine minds.
    fn push(&mut self, group: usize, part: usize, change: [Lanes<S>; 2]) -> Result<(), WorldError>;

    /// Where a part's frame is, of one lane.
    fn pose(&self, group: usize, lane: usize, part: usize) -> Pose;

    /// Fingerprint of one lane's state, continued from `hash`.
    fn hash(&self, group: usize, lane: usize, hash: u64) -> u64;
}
