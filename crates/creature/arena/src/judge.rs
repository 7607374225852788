//! When a motion can be used: looked at for longer than it was trained, never by its fitness.

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Mask, Scalar, math};
use ambulo_world::Physics;
use serde::Serialize;

use crate::episode::Plan;
use crate::measures::{regularity, spectral_arc_length, symmetry};
use crate::meter::{Look, Meter, Tally};
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
    /// Whether it is more than that: a run of more than a body length a second (without legs half),
    /// regular above 0.9, with a cost of transport below 2 (without legs 5); a jump 1.2 times as high
    /// as needed.
    pub good: bool,
    /// Why it is not usable.
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
    pub gain: Option<f64>,
    /// How far it must, metres; of jumps only.
    pub gain_needed: Option<f64>,
    /// Each leg's foot.
    pub feet: Vec<Foot>,
}

/// Why a jumper does not stand at the end, if it does not: over the last half second it is upright,
/// its torso is off the ground and at 0.6 of the standing height or more, and it has a foot on the
/// ground at some time.
pub(crate) fn lying(tally: &Tally, body: &Body) -> Option<String> {
    let low = tally.start[1] - 0.4 * f64::from(body.standing_height());
    if tally.tail_tilt >= 1.0 {
        Some(format!("at the end it is tilted by {:.1} rad", tally.tail_tilt))
    } else if tally.tail_torso {
        Some("at the end its torso is on the ground".into())
    } else if tally.tail_low < low {
        Some("at the end it does not stand: its torso is below 0.6 of its height".into())
    } else if !tally.tail_foot {
        Some("at the end no foot is on the ground".into())
    } else {
        None
    }
}

/// Why it does not carry itself, if so. Not asked of creatures without legs: they may lie and
/// roll, as the seed's Apod does and is called usable (section 5.2.1).
pub(crate) fn posture(tally: &Tally, body: &Body) -> Vec<String> {
    let mut reasons = Vec::new();
    if body.legs().is_empty() {
        return reasons;
    }
    if tally.upright <= 0.95 {
        let share = 100.0 * tally.upright;
        reasons.push(format!("upright in {share:.0} % of the steps, 95 % are needed"));
    }
    if tally.torso_contact >= 0.05 {
        let share = 100.0 * tally.torso_contact;
        reasons
            .push(format!("its torso is on the ground in {share:.0} % of the steps, 5 % at most"));
    }
    reasons
}

/// Whether a leg counts as used.
fn used(tally: &Tally, body: &Body, leg: usize) -> bool {
    let joints = body.legs()[leg].joints.iter();
    let moves = joints.map(|&joint| tally.deviation[joint]).fold(0.0, f64::max);
    let [least, most] = LEG_STANDS;
    moves > LEG_MOVES && (least..=most).contains(&tally.duty[leg])
}

/// Which legs, or without legs which joints, are idle, if any.
pub(crate) fn idle(tally: &Tally, body: &Body) -> Option<String> {
    if body.legs().is_empty() {
        return still(tally, body);
    }
    let legs = (0..body.legs().len()).filter(|&leg| !used(tally, body, leg));
    let name = |leg: usize| body.parts()[body.legs()[leg].parts[0]].name.as_str();
    named(legs.map(name).collect())
}

/// Which joints do not move, if any.
pub(crate) fn still(tally: &Tally, body: &Body) -> Option<String> {
    let names = body.driven().iter().map(|&joint| body.joints()[joint].name.as_str());
    let still = names.zip(&tally.deviation).filter(|(_, sd)| **sd <= LEG_MOVES);
    named(still.map(|(name, _)| name).collect())
}

fn named(idle: Vec<&str>) -> Option<String> {
    (!idle.is_empty()).then(|| format!("idle: {}", idle.join(", ")))
}

/// Angles of each joint from a step on.
fn joint_series(rollout: &Rollout, from: usize, joints: usize) -> Vec<Vec<f32>> {
    let series = |joint| rollout.angles.iter().skip(from * joints + joint).step_by(joints).copied();
    (0..joints).map(|joint| series(joint).collect()).collect()
}

pub(crate) fn judge(arena: &Arena, rollout: &Rollout) -> Judgement {
    let (body, dt) = (&*rollout.body, rollout.dt);
    let steps = rollout.steps();
    let tally = measured(body, rollout);
    let joints = body.driven().len();
    let half = joint_series(rollout, steps / 2, joints);
    let (regular, period) = regularity(&half, dt);
    let torso = &rollout.torso[steps / 2..];
    let speeds: Vec<f32> = torso
        .windows(2)
        .map(|w| ((w[1][0] - w[0][0]).powi(2) + (w[1][1] - w[0][1]).powi(2)).sqrt() / dt)
        .collect();
    let length = f64::from(body.length());
    let slowest = tally.last_speeds().into_iter().fold(f64::INFINITY, f64::min);
    let mut reasons = arena.task().reasons(&tally, body);
    if rollout.lost {
        reasons.insert(0, "its controller gives something that is not a number".into());
    }
    let needed = arena.task().rise_needed(body);
    let feet = feet(body, rollout, &tally, period);
    let mut judgement = Judgement {
        usable: reasons.is_empty(),
        good: false,
        reasons,
        steps,
        distance: tally.distance(),
        speed_bl_s: tally.last_speed() / length,
        slowest_bl_s: slowest / length,
        upright: tally.upright,
        torso_contact: tally.torso_contact,
        legs_used: feet.iter().filter(|foot| foot.used).count(),
        legs: body.legs().len(),
        regularity: regular,
        period_s: period,
        cost_of_transport: cost_of_transport(&tally, body, &arena.settings().world),
        symmetry: symmetry(&half, body.pairs(), period, dt),
        saturation: tally.saturation,
        smoothness: spectral_arc_length(&speeds, dt),
        gain: needed.map(|_| tally.rise),
        gain_needed: needed,
        feet,
    };
    judgement.good = judgement.usable && is_good(&judgement);
    judgement
}

/// More than usable: running, fast, regular and cheap; jumping, higher than needed.
fn is_good(judgement: &Judgement) -> bool {
    if let (Some(gain), Some(needed)) = (judgement.gain, judgement.gain_needed) {
        return gain > 1.2 * needed;
    }
    let (speed, cost) = if judgement.legs == 0 { (0.5, 5.0) } else { (1.0, 2.0) };
    judgement.speed_bl_s > speed
        && judgement.regularity.is_some_and(|regular| regular > 0.9)
        && judgement.cost_of_transport.is_some_and(|paid| paid < cost)
}

/// Σ|torque · speed| dt / (mass · gravity · distance); none without a way forward.
fn cost_of_transport(tally: &Tally, body: &Body, physics: &Physics) -> Option<f64> {
    let weight = f64::from(body.mass() * physics.mass_scale * physics.gravity);
    (tally.distance() > 0.1).then(|| tally.work / (weight * tally.distance()))
}

/// Measures a recording as an episode is measured when it happens.
fn measured(body: &Body, rollout: &Rollout) -> Tally {
    let (parts, joints) = (body.parts().len(), body.driven().len());
    let lanes = |values: &[f32]| values.iter().map(|&v| Lanes::from(v)).collect::<Vec<_>>();
    let touching = |step: usize| {
        let parts = &rollout.touching[step * parts..(step + 1) * parts];
        parts.iter().map(|&on| Mask::from(on)).collect::<Vec<_>>()
    };
    let (steps, dt) = (rollout.steps(), Lanes::from(rollout.dt));
    let start = rollout.torso[0].map(Lanes::from);
    let plan = Plan { steps: steps as u32, ..Plan::JUDGED };
    let mut meter = Meter::new(Scalar, &[body], dt, start, &touching(0), plan);
    for step in 1..=steps {
        let row = |values: &[f32], step: usize| lanes(&values[step * joints..(step + 1) * joints]);
        let (now, before) = (row(&rollout.angles, step), row(&rollout.angles, step - 1));
        let speed = |(a, b): (&Lanes<_>, &Lanes<_>)| math::wrap(*a - *b) * (dt.like(1.0) / dt);
        meter.watch(&Look {
            torso: rollout.torso[step].map(Lanes::from),
            tilt: rollout.tilt[step].into(),
            speeds: &now.iter().zip(&before).map(speed).collect::<Vec<_>>(),
            angles: &now,
            touching: &touching(step),
            commands: &row(&rollout.commands, step - 1),
            torques: &row(&rollout.torques, step - 1),
        });
    }
    meter.tally(0)
}

fn feet(body: &Body, rollout: &Rollout, tally: &Tally, period: Option<f64>) -> Vec<Foot> {
    let first = body.legs().first().map(|leg| leg.foot);
    let foot = |(index, leg): (usize, &ambulo_body::Leg)| {
        let after = period.zip(first).and_then(|(period, first)| {
            phase(body, rollout, first, leg.foot, period / f64::from(rollout.dt))
        });
        Foot {
            leg: body.parts()[leg.parts[0]].name.clone(),
            duty: tally.duty[index],
            phase: after,
            used: used(tally, body, index),
        }
    };
    body.legs().iter().enumerate().map(foot).collect()
}

/// How much later than `first` a foot lands, as a part of the cycle (in steps), 0 to 1: the circular
/// mean over the second half.
fn phase(body: &Body, rollout: &Rollout, first: usize, foot: usize, cycle: f64) -> Option<f64> {
    let steps = rollout.steps();
    let touches = |step: usize, part: usize| rollout.touching[step * body.parts().len() + part];
    let mean = |part: usize| {
        let landings =
            (steps / 2 + 1..=steps).filter(|&step| touches(step, part) && !touches(step - 1, part));
        let angle = |step: usize| std::f64::consts::TAU * step as f64 / cycle;
        let sum = landings.fold([0.0, 0.0, 0.0], |[x, y, n], step| {
            let (sin, cos) = libm::sincos(angle(step));
            [x + cos, y + sin, n + 1.0]
        });
        (sum[2] > 0.0).then(|| libm::atan2(sum[1], sum[0]) / std::f64::consts::TAU)
    };
    Some((mean(foot)? - mean(first)?).rem_euclid(1.0))
}
