//! Hurdles: over blocks in the way.

use ambulo_body::Body;
use ambulo_pilot::Kind;
use ambulo_world::{Ground, Physics};

use super::{Run, Task, on};
use crate::Term;
use crate::meter::Tally;

/// Behind the third block, metres from the start.
const THIRD: f64 = 3.0 + 3.0 * 2.15;

/// Over blocks.
pub struct Hurdles;

impl Task for Hurdles {
    fn name(&self) -> &'static str {
        "hurdles"
    }

    fn about(&self) -> &'static str {
        "get over blocks in the way"
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

    /// Low, narrow blocks, unless other ground is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Hurdles { height: 0.06, width: 0.15, between: 2.0 }, asked)
    }

    /// A usable run that has got past at least three of them.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let mut reasons = Run.reasons(tally, body);
        let distance = tally.distance();
        if distance <= THIRD {
            reasons.push(format!("it got {distance:.1} m far, {THIRD:.1} are needed"));
        }
        reasons
    }
}
