//! Holes: over gaps in the ground.

use ambulo_body::{Body, Sensor};
use ambulo_pilot::Kind;
use ambulo_world::{Ground, Physics};

use super::{Task, on, run_past, seeing};
use crate::meter::Tally;

/// Behind the third hole, metres from the start.
const THIRD: f64 = 3.0 + 3.0 * 2.15;

/// Over gaps.
pub struct Holes;

impl Task for Holes {
    fn name(&self) -> &'static str {
        "holes"
    }

    fn about(&self) -> &'static str {
        "get over holes in the ground"
    }

    /// Not too short: the ground is level for the first three metres.
    fn grow(&self) -> &'static [u32] {
        &[500, 1000]
    }

    fn controller(&self) -> Kind {
        Kind::OscillatorNetwork
    }

    /// Narrow gaps, unless other ground is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Holes { width: 0.15, between: 2.0 }, asked)
    }

    fn sensors(&self) -> Option<Vec<Sensor>> {
        seeing()
    }

    /// A usable run that has got past at least three of them.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        run_past(THIRD, tally, body)
    }
}
