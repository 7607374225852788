//! Swim: forward, in water.

use ambulo_body::Body;
use ambulo_world::Physics;

use super::Task;
use crate::judge::still;
use crate::meter::Tally;
use crate::terms::mean;

/// The least speed of a usable swimmer, body lengths a second.
const SPEED: f64 = 0.2;

/// Forward, in water.
pub struct Swim;

impl Task for Swim {
    fn name(&self) -> &'static str {
        "swim"
    }

    fn about(&self) -> &'static str {
        "swim forward in water"
    }

    /// Water is slow.
    fn grow(&self) -> &'static [u32] {
        &[500]
    }

    fn falls(&self) -> bool {
        false
    }

    /// 1.5 tanh(v/1.5) (0.2 + 0.8 mean u) (1 − 0.3 mean|tilt|) − 0.01 P/(m g L), v in body lengths a
    /// second, u = min(1, sd/0.2) of each joint, P the motors' power.
    fn natural(&self, tally: &Tally, body: &Body, gravity: f64) -> f64 {
        let length = f64::from(body.length());
        let uses: Vec<_> = tally.deviation.iter().map(|sd| (sd / 0.2).min(1.0)).collect();
        let power = tally.power();
        let weight = f64::from(body.mass()) * gravity.max(1e-3);
        let speed = tally.speed() / length;
        let straight = (1.0 - 0.3 * tally.mean_tilt).max(0.0);
        1.5 * libm::tanh(speed / 1.5) * (0.2 + 0.8 * mean(&uses)) * straight
            - 0.01 * power / (weight * length)
    }

    fn world(&self, asked: Physics) -> Physics {
        Physics { water: Some(asked.water.unwrap_or_default()), ..asked }
    }

    fn promising(&self, tally: &Tally, body: &Body) -> bool {
        self.reasons(tally, body).is_empty()
    }

    /// Steady speed, no somersaults, every joint moves.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String> {
        let mut reasons = Vec::new();
        let speed = tally.last_speed() / f64::from(body.length());
        if speed <= SPEED {
            reasons.push(format!(
                "slow: {speed:.2} body lengths a second in the last quarter, {SPEED} are needed"
            ));
        }
        if tally.most_turned >= std::f64::consts::TAU {
            reasons.push("it turns somersaults".into());
        }
        reasons.extend(still(tally, body));
        reasons
    }
}
