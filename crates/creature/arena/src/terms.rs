//! What a fitness is made of.

use std::collections::BTreeMap;

use ambulo_body::Body;
use serde::{Deserialize, Serialize};

use crate::Task;
use crate::meter::Tally;

/// One measured thing of an episode; more is more of it, whether that is good or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    /// The task's own measure of how well it is done the way a creature would do it.
    Natural,
    /// How far forward the torso's centre got from start to end, metres.
    Distance,
    /// How far the torso's centre rose at most, metres.
    Height,
    /// Work of the motors, |torque · speed| over time, in the weight of the creature times a metre.
    Energy,
    /// The most that the torso had turned from the start pose, in turns.
    Rollover,
    /// How often a motor is told to reverse, times a second, mean of the joints.
    DirectionChange,
    /// Share of the motor commands that are above 95 % of full speed.
    Saturation,
    /// How much the legs are used, 0 to 1: mean of min(1, sd/0.2) · min(1, duty/0.15) ·
    /// min(1, (1 − duty)/0.15), sd the greatest standard deviation of a leg's joints in radians, duty
    /// the share of steps with its foot on the ground. 1 without legs.
    LegUse,
    /// How much paired joints do the same half a period apart, 0 to 1; 0 without pairs or period.
    Symmetry,
}

impl Term {
    /// All of them.
    pub const ALL: [Term; 9] = [
        Term::Natural,
        Term::Distance,
        Term::Height,
        Term::Energy,
        Term::Rollover,
        Term::DirectionChange,
        Term::Saturation,
        Term::LegUse,
        Term::Symmetry,
    ];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Term::Natural => "natural",
            Term::Distance => "distance",
            Term::Height => "height",
            Term::Energy => "energy",
            Term::Rollover => "rollover",
            Term::DirectionChange => "direction_change",
            Term::Saturation => "saturation",
            Term::LegUse => "leg_use",
            Term::Symmetry => "symmetry",
        }
    }
}

/// Terms by name; those that nobody asked for are not measured.
pub type Terms = BTreeMap<Term, f64>;

impl Term {
    /// Its value, from what was measured of an episode; gravity in metres a second².
    pub(crate) fn of(self, tally: &Tally, body: &Body, gravity: f64, task: &dyn Task) -> f64 {
        match self {
            Term::Natural => task.natural(tally, body, gravity),
            Term::Distance => tally.distance(),
            Term::Height => tally.rise,
            Term::Energy => tally.work / (f64::from(body.mass()) * gravity.max(1e-3)),
            Term::Rollover => tally.most_turned / std::f64::consts::TAU,
            Term::DirectionChange => {
                let commands = tally.lived.max(1.0) * tally.dt * tally.deviation.len() as f64;
                tally.reversals / commands
            }
            Term::Saturation => tally.saturation,
            Term::LegUse if body.legs().is_empty() => 1.0,
            Term::LegUse => mean(&tally.uses(body)),
            Term::Symmetry => tally.symmetry(body),
        }
    }
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
