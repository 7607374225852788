//! Run: as far forward as possible (the seed, section 4.2.2).

use super::Task;
use crate::Term;
use crate::judge::{Judgement, Seen};

/// Forward, as far as possible.
pub struct Run;

impl Task for Run {
    fn name(&self) -> &'static str {
        "run"
    }

    fn about(&self) -> &'static str {
        "move forward, as far as possible"
    }

    fn steps(&self) -> u32 {
        2000
    }

    fn weights(&self) -> &'static [(Term, f64)] {
        &[(Term::Distance, 1.0)]
    }

    /// Steady speed, upright, on its legs, all of them.
    fn reasons(&self, seen: &Seen<'_>, judgement: &mut Judgement) -> Vec<String> {
        let mut reasons = Vec::new();
        if judgement.speed_bl_s <= 0.3 {
            reasons.push(format!(
                "slow: {:.2} body lengths a second in the last quarter, 0.3 are needed",
                judgement.speed_bl_s
            ));
        }
        let slowest = judgement.slowest_bl_s;
        if slowest <= 0.15 {
            reasons.push(format!(
                "it stalls: {slowest:.2} body lengths a second in a part of the last quarter, 0.15 \
                 are needed"
            ));
        }
        reasons.extend(seen.posture(judgement));
        reasons.extend(seen.idle(judgement));
        reasons
    }
}
