//! Keep upright: stand, whatever pushes.

use ambulo_body::Body;
use ambulo_pilot::Kind;

use super::Task;
use crate::Term;
use crate::judge::posture;
use crate::meter::Tally;

/// The farthest that a usable stand may drift, body lengths.
const DRIFT: f64 = 2.0;

/// Stand, whatever pushes.
pub struct KeepUpright;

impl Task for KeepUpright {
    fn name(&self) -> &'static str {
        "keep_upright"
    }

    fn about(&self) -> &'static str {
        "stand while something pushes the torso now and then"
    }

    fn steps(&self) -> u32 {
        1000
    }

    fn weights(&self) -> &'static [(Term, f64)] {
        &[(Term::Natural, 1.0)]
    }

    fn natural_steps(&self) -> u32 {
        1000
    }

    fn grow(&self) -> &'static [u32] {
        &[400]
    }

    fn falls(&self) -> bool {
        true
    }

    fn controller(&self) -> Kind {
        Kind::Network
    }

    /// alive (1 − 0.5 mean|tilt|) / (1 + 0.2 |distance| / length) − 0.05 P/(m g L), P the motors'
    /// power.
    fn natural(&self, tally: &Tally, body: &Body, gravity: f64) -> f64 {
        let length = f64::from(body.length());
        let power = tally.power();
        let weight = f64::from(body.mass()) * gravity.max(1e-3);
        let drift = 1.0 + 0.2 * tally.distance().abs() / length;
        tally.alive() * (1.0 - 0.5 * tally.mean_tilt) / drift - 0.05 * power / (weight * length)
    }

    fn pushed(&self) -> bool {
        true
    }

    fn promising(&self, tally: &Tally, body: &Body) -> bool {
        self.reasons(tally, body).is_empty()
    }

    /// Upright nearly always, its torso off the ground, about where it began.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let mut reasons = posture(tally, body);
        let drift = tally.distance().abs() / f64::from(body.length());
        if drift >= DRIFT {
            reasons.push(format!("it drifted {drift:.1} body lengths, {DRIFT:.0} at most"));
        }
        reasons
    }
}
