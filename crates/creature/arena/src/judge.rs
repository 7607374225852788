//! When a motion can be used: looked at for longer than it was trained, never by its fitness.

use ambulo_body::Body;
use serde::Serialize;

use crate::measures::{deviation, regularity, spectral_arc_length, symmetry};
use crate::{Arena, Rollout};

/// A leg's least standard deviation of a joint, radians, and least and greatest share of steps with
/// its foot on the ground, to count as used.
const LEG_MOVES: f64 = 0.08;
const LEG_STANDS: [f64; 2] = [0.02, 0.98];

/// How a foot steps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Foot {
    /// The leg's name: that of its first part.
    pub leg: String,
    /// Share of steps with the foot on the ground.
    pub duty: f64,
    /// When it lands, as a part of the period after the first leg's foot; none without a period.
    pub phase: Option<f64>,
    /// Whether the leg counts as used.
    pub used: bool,
}

/// What is to be said of a recorded motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// Whether a game could use it.
    pub usable: bool,
    /// Why not.
    pub reasons: Vec<String>,
    /// Steps that were looked at.
    pub steps: usize,
    /// Forward from start to end, metres.
    pub distance: f64,
    /// In the last quarter, body lengths a second.
    pub speed_bl_s: f64,
    /// In the slowest of the four parts of the last quarter, body lengths a second.
    pub slowest_bl_s: f64,
    /// Share of steps with the torso tilted by less than 1 rad.
    pub upright: f64,
    /// Share of steps with the torso on the ground.
    pub torso_contact: f64,
    /// Legs that are used.
    pub legs_used: usize,
    /// Legs that there are.
    pub legs: usize,
    /// Highest peak of the joint angles' autocorrelation in the second half; above 0.9 it looks
    /// like a gait.
    pub regularity: Option<f64>,
    /// Where that peak is, seconds.
    pub period_s: Option<f64>,
    /// Σ|torque · speed| dt / (mass · gravity · distance); none without a way forward.
    pub cost_of_transport: Option<f64>,
    /// 1 − mean|left(t) − right(t + period/2)| / range over the second half; none without pairs.
    pub symmetry: Option<f64>,
    /// Share of the motor commands above 95 % of full speed.
    pub saturation: f64,
    /// Spectral arc length of the torso's speed in the second half; nearer to 0 is smoother.
    pub smoothness: Option<f64>,
    /// How far the torso rose, metres; of jumps only.
    pub gain: Option<f32>,
    /// How far it must, metres; of jumps only.
    pub gain_needed: Option<f32>,
    /// Each leg's foot.
    pub feet: Vec<Foot>,
}

/// A rollout and whose it is, with what tasks ask about it.
pub struct Seen<'a> {
    /// The creature.
    pub body: &'a Body,
    rollout: &'a Rollout,
}

impl Seen<'_> {
    fn touches(&self, step: usize, part: usize) -> bool {
        self.rollout.touching[step * self.body.parts().len() + part]
    }

    /// Share of the steps with a part on the ground.
    fn duty(&self, part: usize) -> f64 {
        let steps = self.rollout.steps();
        let on = (1..=steps).filter(|&step| self.touches(step, part)).count();
        on as f64 / steps.max(1) as f64
    }

    /// How far the torso is tilted after a step, radians, 0 to π.
    pub fn tilt(&self, step: usize) -> f32 {
        self.rollout.tilt[step].abs()
    }

    /// How far the torso rose at most, and when.
    pub fn highest(&self) -> (f32, usize) {
        let heights = self.rollout.torso.iter().map(|at| at[1]).enumerate();
        let (step, most) = heights
            .fold((0, f32::NEG_INFINITY), |best, now| if now.1 > best.1 { now } else { best });
        (most - self.rollout.torso[0][1], step)
    }

    /// Whether there was a step, after the first touch, with none of these parts on the ground.
    pub fn afloat(&self, part: impl Fn(usize) -> bool) -> bool {
        let parts: Vec<_> = (0..self.body.parts().len()).filter(|&p| part(p)).collect();
        let on = |step: usize| parts.iter().any(|&part| self.touches(step, part));
        let landed = (0..=self.rollout.steps()).find(|&step| on(step));
        landed.is_some_and(|first| (first..=self.rollout.steps()).any(|step| !on(step)))
    }

    /// Why it does not stand at the end, if it does not: over the last half second it is upright,
    /// its torso is off the ground and at 0.6 of the standing height or more, and it has a foot on
    /// the ground at some time.
    pub fn lying(&self) -> Option<String> {
        let steps = self.rollout.steps();
        let from = steps.saturating_sub((0.5 / self.rollout.dt) as usize);
        let tilt = (from..=steps).map(|step| self.tilt(step)).fold(0.0, f32::max);
        if tilt >= 1.0 {
            return Some(format!("at the end it is tilted by {tilt:.1} rad"));
        }
        if (from..=steps).any(|step| self.touches(step, self.body.torso())) {
            return Some("at the end its torso is on the ground".into());
        }
        let low = self.rollout.torso[0][1] - 0.4 * self.body.standing_height();
        if (from..=steps).any(|step| self.rollout.torso[step][1] < low) {
            return Some(
                "at the end it does not stand: its torso is below 0.6 of its height".into(),
            );
        }
        let feet = self.body.legs().iter().map(|leg| leg.foot);
        let mut feet = feet.flat_map(|foot| (from..=steps).map(move |step| (step, foot)));
        if !feet.any(|(step, foot)| self.touches(step, foot)) {
            return Some("at the end no foot is on the ground".into());
        }
        None
    }

    /// Why it does not carry itself, if so. Not asked of creatures without legs: they may lie and
    /// roll, as the seed's Apod does and is called usable (section 5.2.1).
    pub fn posture(&self, judgement: &Judgement) -> Vec<String> {
        let mut reasons = Vec::new();
        if self.body.legs().is_empty() {
            return reasons;
        }
        if judgement.upright <= 0.95 {
            reasons.push(format!(
                "upright in {:.0} % of the steps, 95 % are needed",
                100.0 * judgement.upright
            ));
        }
        if judgement.torso_contact >= 0.05 {
            reasons.push(format!(
                "its torso is on the ground in {:.0} % of the steps, 5 % at most",
                100.0 * judgement.torso_contact
            ));
        }
        reasons
    }

    /// Which legs, or without legs which joints, are idle, if any.
    pub fn idle(&self, judgement: &Judgement) -> Vec<String> {
        let idle: Vec<&str> = if self.body.legs().is_empty() {
            let names = self.body.driven().iter().map(|&j| self.body.joints()[j].name.as_str());
            let series = joint_series(self.rollout, 0, self.body.driven().len());
            let still = names.zip(series).filter(|(_, angles)| deviation(angles) <= LEG_MOVES);
            still.map(|(name, _)| name).collect()
        } else {
            judgement.feet.iter().filter(|foot| !foot.used).map(|foot| foot.leg.as_str()).collect()
        };
        if idle.is_empty() { vec![] } else { vec![format!("idle: {}", idle.join(", "))] }
    }
}

/// Angles of each joint from a step on.
fn joint_series(rollout: &Rollout, from: usize, joints: usize) -> Vec<Vec<f32>> {
    let series = |joint| rollout.angles.iter().skip(from * joints + joint).step_by(joints).copied();
    (0..joints).map(|joint| series(joint).collect()).collect()
}

pub(crate) fn judge(arena: &Arena, rollout: &Rollout) -> Judgement {
    let body = arena.body();
    let seen = Seen { body, rollout };
    let (steps, dt) = (rollout.steps(), rollout.dt);
    let share = |count: usize| count as f64 / steps.max(1) as f64;
    let x = |step: usize| f64::from(rollout.torso[step][0]);
    let speed = |from: usize, to: usize| {
        (x(to) - x(from)) / ((to - from).max(1) as f64 * f64::from(dt) * f64::from(body.length()))
    };
    let quarter = steps - steps / 4;
    let part = |i: usize| quarter + i * (steps - quarter) / 4;
    let joints = body.driven().len();
    let half = joint_series(rollout, steps / 2, joints);
    let (regular, period) = regularity(&half, dt);
    let whole = joint_series(rollout, 0, joints);
    let saturated = rollout.commands.iter().filter(|command| command.abs() > 0.95).count();
    let torso = &rollout.torso[steps / 2..];
    let speeds: Vec<f32> = torso
        .windows(2)
        .map(|w| ((w[1][0] - w[0][0]).powi(2) + (w[1][1] - w[0][1]).powi(2)).sqrt() / dt)
        .collect();
    let distance = x(steps) - x(0);
    let weight = body.mass() * arena.settings().world.mass_scale * arena.settings().world.gravity;
    let work = work(rollout, joints);
    let mut judgement = Judgement {
        usable: false,
        reasons: vec![],
        steps,
        distance,
        speed_bl_s: speed(quarter, steps),
        slowest_bl_s: (0..4).map(|i| speed(part(i), part(i + 1))).fold(f64::INFINITY, f64::min),
        upright: share((1..=steps).filter(|&step| seen.tilt(step) < 1.0).count()),
        torso_contact: seen.duty(body.torso()),
        legs_used: 0,
        legs: body.legs().len(),
        regularity: regular,
        period_s: period,
        cost_of_transport: (distance > 0.1).then(|| work / (f64::from(weight) * distance)),
        symmetry: symmetry(&half, body.pairs(), period, dt),
        saturation: saturated as f64 / rollout.commands.len().max(1) as f64,
        smoothness: spectral_arc_length(&speeds, dt),
        gain: None,
        gain_needed: None,
        feet: feet(&seen, &whole, period),
    };
    judgement.legs_used = judgement.feet.iter().filter(|foot| foot.used).count();
    let mut reasons = arena.task().reasons(&seen, &mut judgement);
    if rollout.lost {
        reasons.insert(0, "its network gives something that is not a number".into());
    }
    judgement.usable = reasons.is_empty();
    judgement.reasons = reasons;
    judgement
}

/// Σ|torque · speed| dt, joules.
fn work(rollout: &Rollout, joints: usize) -> f64 {
    let after = rollout.angles.iter().skip(joints);
    let turned =
        after.zip(&rollout.angles).map(|(now, before)| crate::measures::wrap(now - before));
    turned.zip(&rollout.torques).map(|(turn, torque)| f64::from((turn * torque).abs())).sum()
}

fn feet(seen: &Seen<'_>, angles: &[Vec<f32>], period: Option<f64>) -> Vec<Foot> {
    let first = seen.body.legs().first().map(|leg| leg.foot);
    let foot = |leg: &ambulo_body::Leg| {
        let duty = seen.duty(leg.foot);
        let moves = leg.joints.iter().map(|&joint| deviation(&angles[joint])).fold(0.0, f64::max);
        let [least, most] = LEG_STANDS;
        let after = period.zip(first).and_then(|(period, first)| {
            let cycle = period / f64::from(seen.rollout.dt);
            phase(seen, first, leg.foot, cycle)
        });
        Foot {
            leg: seen.body.parts()[leg.parts[0]].name.clone(),
            duty,
            phase: after,
            used: moves > LEG_MOVES && (least..=most).contains(&duty),
        }
    };
    seen.body.legs().iter().map(foot).collect()
}

/// How much later than `first` a foot lands, as a part of the cycle (in steps), 0 to 1: the circular
/// mean over the second half.
fn phase(seen: &Seen<'_>, first: usize, foot: usize, cycle: f64) -> Option<f64> {
    let steps = seen.rollout.steps();
    let mean = |part: usize| {
        let landings = (steps / 2 + 1..=steps)
            .filter(|&step| seen.touches(step, part) && !seen.touches(step - 1, part));
        let angle = |step: usize| std::f64::consts::TAU * step as f64 / cycle;
        let sum = landings.fold([0.0, 0.0, 0.0], |[x, y, n], step| {
            let (sin, cos) = libm::sincos(angle(step));
            [x + cos, y + sin, n + 1.0]
        });
        (sum[2] > 0.0).then(|| libm::atan2(sum[1], sum[0]) / std::f64::consts::TAU)
    };
    Some((mean(foot)? - mean(first)?).rem_euclid(1.0))
}
