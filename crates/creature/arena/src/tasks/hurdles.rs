//! Hurdles: over blocks in the way.

use ambulo_body::Body;
use ambulo_world::{Ground, Physics};

use super::{Task, on, run_past};
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

    /// Not too short: the ground is level for the first three metres.
    fn grow(&self) -> &'static [u32] {
        &[500, 1000]
    }

    /// Low, narrow blocks, unless other ground is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Hurdles { height: 0.06, width: 0.15, between: 2.0 }, asked)
    }

    /// A usable run that has got past at least three of them.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        run_past(THIRD, tally, body)
    }
}
