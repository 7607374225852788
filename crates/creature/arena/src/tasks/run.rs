//! Run: as far forward as possible (the seed, section 4.2.2).

use ambulo_body::Body;

use super::Task;
use crate::judge::{idle, posture};
use crate::meter::Tally;
use crate::terms::mean;

/// Forward, as far as possible.
pub struct Run;

impl Task for Run {
    fn name(&self) -> &'static str {
        "run"
    }

    fn about(&self) -> &'static str {
        "move forward, as far as possible"
    }

    fn grow(&self) -> &'static [u32] {
        &[300, 600, 1000]
    }

    /// Steady speed, upright, on its legs, all of them.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let length = f64::from(body.length());
        let mut reasons = Vec::new();
        let speed = tally.last_speed() / length;
        if speed <= 0.3 {
            reasons.push(format!(
                "slow: {speed:.2} body lengths a second in the last quarter, 0.3 are needed"
            ));
        }
        let slowest = tally.last_speeds().into_iter().fold(f64::INFINITY, f64::min) / length;
        if slowest <= 0.15 {
            reasons.push(format!(
                "it stalls: {slowest:.2} body lengths a second in a part of the last quarter, 0.15 \
                 are needed"
            ));
        }
        reasons.extend(posture(tally, body));
        reasons.extend(idle(tally, body));
        reasons
    }
}

/// Speed up to where more of it would make the gait brittle, with every leg at work, upright, to
/// the end, without waste:
/// 1.5 tanh(v/1.5) (0.2 + 0.5 mean u + 0.3 min u) (1 − 0.3 mean|tilt|) + 0.2 alive − c P/(m g L),
/// v in body lengths a second, u the use of each leg, P the motors' power. c is 0.05, and 0.02
/// for creatures without legs, which would rather lie still than pay more.
pub(super) fn natural(tally: &Tally, body: &Body, gravity: f64) -> f64 {
    let length = f64::from(body.length());
    let speed = tally.speed() / length;
    let uses = tally.uses(body);
    let least = uses.iter().copied().fold(1.0, f64::min);
    let legs = 0.2 + 0.5 * mean(&uses) + 0.3 * least;
    let straight = 1.0 - 0.3 * tally.mean_tilt;
    let power = tally.power();
    let weight = f64::from(body.mass()) * gravity.max(1e-3);
    let price = if body.legs().is_empty() { 0.02 } else { 0.05 };
    1.5 * libm::tanh(speed / 1.5) * legs * straight + 0.2 * tally.alive()
        - price * power / (weight * length)
}
