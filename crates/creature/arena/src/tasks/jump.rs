//! Jump: as high as possible (the seed, section 4.2.2).

use super::Task;
use crate::Term;
use crate::judge::{Judgement, Seen};

/// Up, as high as possible.
pub struct Jump;

impl Task for Jump {
    fn name(&self) -> &'static str {
        "jump"
    }

    fn about(&self) -> &'static str {
        "lift the torso as high as possible"
    }

    fn steps(&self) -> u32 {
        500
    }

    fn weights(&self) -> &'static [(Term, f64)] {
        &[(Term::Height, 1.0)]
    }

    /// High enough, off the ground, upright at the top, standing at the end.
    fn reasons(&self, seen: &Seen<'_>, judgement: &mut Judgement) -> Vec<String> {
        let legs = !seen.body.legs().is_empty();
        let (gain, apex) = seen.highest();
        let needed =
            if legs { 0.5 * seen.body.standing_height() } else { 0.5 * seen.body.length() };
        judgement.gain = Some(gain);
        judgement.gain_needed = Some(needed);
        let mut reasons = Vec::new();
        if gain <= needed {
            reasons.push(format!("low: the torso rose {gain:.2} m, {needed:.2} are needed"));
        }
        if !legs {
            if !seen.afloat(|_| true) {
                reasons.push("it never left the ground".into());
            }
            return reasons;
        }
        if !seen.afloat(|part| seen.body.legs().iter().any(|leg| leg.foot == part)) {
            reasons.push("its feet never left the ground all at once".into());
        }
        if seen.tilt(apex) >= 1.0 {
            reasons.push(format!("at the top it is tilted by {:.1} rad", seen.tilt(apex)));
        }
        if let Some(reason) = seen.lying() {
            reasons.push(reason);
        }
        reasons
    }
}
