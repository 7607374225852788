//! Rough: over uneven ground.

use ambulo_body::Body;
use ambulo_world::{Ground, Physics};

use super::{Task, on, run_past};
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

    /// Not too short: the ground is level for the first three metres.
    fn grow(&self) -> &'static [u32] {
        &[500, 1000]
    }

    /// Bumps as high as a foot is thick, unless other ground is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Rough { height: 0.06, spacing: 0.4, seed: 1 }, asked)
    }

    /// As a run, and beyond the level start.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        run_past(BEYOND, tally, body)
    }
}
