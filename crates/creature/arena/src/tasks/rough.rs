//! Rough: over uneven ground.

use ambulo_body::Body;
use ambulo_pilot::Kind;
use ambulo_world::{Ground, Physics};

use super::{Run, Task, on};
use crate::Term;
use crate::meter::Tally;

/// Well over where it begins to be uneven, metres from the start.
const BEYOND: f64 = 6.0;

/// Over uneven ground.
pub struct Rough;

impl Task for Rough {
    fn name(&self) -> &'static str {
        "rough"
    }

    fn about(&self) -> &'static str {
        "run over uneven ground"
    }

    fn steps(&self) -> u32 {
        Run.steps()
    }

    fn weights(&self) -> &'static [(Term, f64)] {
        Run.weights()
    }

    fn natural_steps(&self) -> u32 {
        Run.natural_steps()
    }

    /// Not too short: the ground is level for the first three metres.
    fn grow(&self) -> &'static [u32] {
        &[500, 1000]
    }

    fn falls(&self) -> bool {
        true
    }

    fn controller(&self) -> Kind {
        Kind::Oscillator
    }

    /// As a run, but for the ground.
    fn natural(&self, tally: &Tally, body: &Body, gravity: f64) -> f64 {
        Run.natural(tally, body, gravity)
    }

    /// Bumps as high as a foot is thick, unless other ground is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Rough { height: 0.06, spacing: 0.4, seed: 1 }, asked)
    }

    /// As a run, and beyond the level start.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let mut reasons = Run.reasons(tally, body);
        let distance = tally.distance();
        if distance <= BEYOND {
            reasons.push(format!("it got {distance:.1} m far, {BEYOND:.1} are needed"));
        }
        reasons
    }
}
