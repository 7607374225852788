//! Jump: as high as possible (the seed, section 4.2.2).

use ambulo_body::Body;
use ambulo_pilot::Kind;

use super::Task;
use crate::Term;
use crate::judge::lying;
use crate::meter::Tally;

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

    /// Whoever stands after four seconds stands.
    fn natural_steps(&self) -> u32 {
        240
    }

    fn grow(&self) -> &'static [u32] {
        &[]
    }

    fn falls(&self) -> bool {
        false
    }

    fn controller(&self) -> Kind {
        Kind::Poses
    }

    /// Take-off and apex: how far it rises upright in the air, of what is needed, up to twice that.
    /// Landing: how much of the last half second it stands, which is worth more the better the jump.
    /// g (0.4 + 0.6 s) + 0.3 s − 0.05 |tilt at the apex|, without legs g alone.
    fn natural(&self, tally: &Tally, body: &Body, _: f64) -> f64 {
        let needed = self.rise_needed(body).expect("jumps ask for it").max(1e-3);
        let all = (tally.airborne_rise / needed).clamp(0.0, 2.0);
        // What only stretches counts a little, so that there is a way to begin.
        let gain = all + 0.1 * (tally.rise / needed).clamp(-1.0, 2.0);
        if body.legs().is_empty() {
            return gain;
        }
        let stands = tally.tail_stands;
        gain * (0.4 + 0.6 * stands) + 0.3 * stands - 0.05 * tally.apex_tilt
    }

    fn rise_needed(&self, body: &Body) -> Option<f64> {
        let size = if body.legs().is_empty() { body.length() } else { body.standing_height() };
        Some(0.5 * f64::from(size))
    }

    fn promising(&self, tally: &Tally, body: &Body) -> bool {
        self.reasons(tally, body).is_empty()
    }

    /// High enough, off the ground, upright at the top, standing at the end.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let legless = body.legs().is_empty();
        let needed = self.rise_needed(body).expect("jumps ask for it");
        let mut reasons = Vec::new();
        if tally.rise <= needed {
            let rise = tally.rise;
            reasons.push(format!("low: the torso rose {rise:.2} m, {needed:.2} are needed"));
        }
        if legless {
            if !tally.all_afloat {
                reasons.push("it never left the ground".into());
            }
            return reasons;
        }
        if !tally.feet_afloat {
            reasons.push("its feet never left the ground all at once".into());
        }
        if tally.apex_tilt >= 1.0 {
            reasons.push(format!("at the top it is tilted by {:.1} rad", tally.apex_tilt));
        }
        reasons.extend(lying(tally, body));
        reasons
    }
}
