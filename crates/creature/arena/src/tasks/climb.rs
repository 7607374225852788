//! Climb: up a slope or a stair.

use ambulo_body::Body;
use ambulo_world::{Ground, Physics};

use super::{Run, Task, on};
use crate::meter::Tally;

/// Up, on foot.
pub struct Climb;

impl Task for Climb {
    fn name(&self) -> &'static str {
        "climb"
    }

    fn about(&self) -> &'static str {
        "get up a stair or a slope"
    }

    /// Not too short: the ground is level for the first three metres.
    fn grow(&self) -> &'static [u32] {
        &[500, 1000]
    }

    /// A stair of low steps, unless a slope or another stair is asked for.
    fn world(&self, asked: Physics) -> Physics {
        on(Ground::Steps { height: 0.04, length: 0.6 }, asked)
    }

    /// A usable run that ends at least half the standing height higher than it began.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let mut reasons = Run.reasons(tally, body);
        let (climbed, needed) =
            (tally.end[1] - tally.start[1], 0.5 * f64::from(body.standing_height()));
        if climbed <= needed {
            reasons.push(format!("it climbed {climbed:.2} m, {needed:.2} are needed"));
        }
        reasons
    }
}
