//! What a fitness is made of.

use std::collections::BTreeMap;

use ambulo_body::Body;
use serde::{Deserialize, Serialize};

use crate::episode::Moment;
use crate::measures;

/// One measured thing of an episode; more is more of it, whether that is good or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
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
    pub const ALL: [Term; 8] = [
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

/// Which terms are to be measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted([bool; Term::ALL.len()]);

impl Wanted {
    pub fn all() -> Self {
        Self([true; Term::ALL.len()])
    }

    /// Those that have a weight.
    pub fn weighted(weights: &BTreeMap<Term, f64>) -> Self {
        Self(Term::ALL.map(|term| weights.get(&term).is_some_and(|&weight| weight != 0.0)))
    }

    pub fn has(&self, term: Term) -> bool {
        self.0[term as usize]
    }

    /// Whether torques must be read, which costs time.
    pub fn torques(&self) -> bool {
        self.has(Term::Energy)
    }

    /// Whether the joints' angles of every step must be kept.
    fn angles(&self) -> bool {
        self.has(Term::Symmetry)
    }
}

/// Measures one individual's episode as it goes.
#[derive(Clone, Debug)]
pub(crate) struct Meter {
    wanted: Wanted,
    start: [f32; 2],
    end: [f32; 2],
    highest: f32,
    work: f64,
    /// Of the torso, radians, not wrapped.
    turned: f64,
    most_turned: f64,
    last_turned: f32,
    signs: Vec<i8>,
    reversals: u64,
    saturated: u64,
    commands: u64,
    steps: u64,
    angle_sums: Vec<[f64; 2]>,
    on_ground: Vec<u64>,
    angles: Vec<Vec<f32>>,
}

impl Meter {
    /// `start` is where the torso's centre is in the start pose.
    pub fn new(body: &Body, wanted: Wanted, start: [f32; 2]) -> Self {
        let joints = body.driven().len();
        Self {
            wanted,
            start,
            end: start,
            highest: start[1],
            work: 0.0,
            turned: 0.0,
            most_turned: 0.0,
            last_turned: 0.0,
            signs: vec![0; joints],
            reversals: 0,
            saturated: 0,
            commands: 0,
            steps: 0,
            angle_sums: vec![[0.0; 2]; joints],
            on_ground: vec![0; body.legs().len()],
            angles: vec![Vec::new(); joints],
        }
    }

    /// After a step.
    pub fn watch(&mut self, moment: &Moment<'_>) {
        self.steps += 1;
        self.end = moment.torso;
        self.highest = self.highest.max(moment.torso[1]);
        if self.wanted.has(Term::Energy) {
            let powers = moment.torques.iter().zip(&moment.senses.joint_speeds);
            let power: f64 = powers.map(|(t, w)| f64::from(*t) * f64::from(*w)).map(f64::abs).sum();
            self.work += power * f64::from(moment.dt);
        }
        if self.wanted.has(Term::Rollover) {
            let step = measures::wrap(moment.senses.torso_rotation - self.last_turned);
            self.last_turned = moment.senses.torso_rotation;
            self.turned += f64::from(step);
            self.most_turned = self.most_turned.max(self.turned.abs());
        }
        if self.wanted.has(Term::DirectionChange) {
            for (sign, command) in self.signs.iter_mut().zip(moment.commands) {
                let now = if *command > 0.0 { 1 } else { -1 };
                self.reversals += u64::from(*sign * now < 0);
                *sign = now;
            }
        }
        if self.wanted.has(Term::Saturation) {
            let full = moment.commands.iter().filter(|command| command.abs() > 0.95).count();
            self.saturated += full as u64;
            self.commands += moment.commands.len() as u64;
        }
        if self.wanted.has(Term::LegUse) {
            for (sums, angle) in self.angle_sums.iter_mut().zip(&moment.senses.joint_angles) {
                let angle = f64::from(*angle);
                *sums = [sums[0] + angle, sums[1] + angle * angle];
            }
            for (count, on) in self.on_ground.iter_mut().zip(&moment.senses.foot_contacts) {
                *count += u64::from(*on);
            }
        }
        if self.wanted.angles() {
            for (series, angle) in self.angles.iter_mut().zip(&moment.senses.joint_angles) {
                series.push(*angle);
            }
        }
    }

    /// The terms that were asked for; `dt` in seconds, `gravity` in metres a second².
    pub fn terms(&self, body: &Body, dt: f32, gravity: f32) -> Terms {
        let wanted = Term::ALL.into_iter().filter(|&term| self.wanted.has(term));
        wanted.map(|term| (term, self.term(term, body, dt, gravity))).collect()
    }

    fn term(&self, term: Term, body: &Body, dt: f32, gravity: f32) -> f64 {
        let steps = self.steps.max(1) as f64;
        match term {
            Term::Distance => f64::from(self.end[0]) - f64::from(self.start[0]),
            Term::Height => f64::from(self.highest) - f64::from(self.start[1]),
            Term::Energy => self.work / f64::from(body.mass() * gravity.max(1e-3)),
            Term::Rollover => self.most_turned / std::f64::consts::TAU,
            Term::DirectionChange => {
                self.reversals as f64 / (steps * f64::from(dt) * self.signs.len() as f64)
            }
            Term::Saturation => self.saturated as f64 / self.commands.max(1) as f64,
            Term::LegUse => {
                let legs = body.legs();
                let use_of = |(leg, &on): (&ambulo_body::Leg, &u64)| {
                    let spread = leg.joints.iter().map(|&joint| {
                        let [sum, squares] = self.angle_sums[joint];
                        (squares / steps - (sum / steps).powi(2)).max(0.0).sqrt()
                    });
                    let (sd, duty) = (spread.fold(0.0, f64::max), on as f64 / steps);
                    (sd / 0.2).min(1.0) * (duty / 0.15).min(1.0) * ((1.0 - duty) / 0.15).min(1.0)
                };
                let sum: f64 = legs.iter().zip(&self.on_ground).map(use_of).sum();
                if legs.is_empty() { 1.0 } else { sum / legs.len() as f64 }
            }
            Term::Symmetry => {
                let (_, period) = measures::regularity(&self.angles, dt);
                measures::symmetry(&self.angles, body.pairs(), period, dt).unwrap_or(0.0)
            }
        }
    }
}
