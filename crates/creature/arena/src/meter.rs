//! What is measured of an episode, as it goes, in all lanes: the one source of every fitness and every
//! judgement.

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Mask, Simd, math};

use crate::episode::Plan;
use crate::measures;

/// The time at the end of an episode in which a jumper must stand, seconds.
const TAIL: f32 = 0.5;

/// What there is to see of a group of individuals after a step.
pub(crate) struct Look<'a, S: Simd> {
    /// Centre of the torso, metres.
    pub torso: [Lanes<S>; 2],
    /// How far the torso has turned, radians, −π to π.
    pub tilt: Lanes<S>,
    /// Of each driven joint, radians, and how fast, radians a second.
    pub angles: &'a [Lanes<S>],
    pub speeds: &'a [Lanes<S>],
    /// Whether each part touches the ground.
    pub touching: &'a [Mask<S>],
    /// What the motors were told, −1 to 1, and gave, newton metres; torques may be left out.
    pub commands: &'a [Lanes<S>],
    pub torques: &'a [Lanes<S>],
}

/// What was measured of one individual's episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Steps that the episode was to have, and that it had before a fall ended it.
    pub steps: f64,
    /// See there.
    pub lived: f64,
    /// Seconds a step.
    pub dt: f64,
    /// Where the torso's centre was at the start, metres.
    pub start: [f64; 2],
    /// Where it was at the end, or at the fall.
    pub end: [f64; 2],
    /// Where it was, forward, at the four quarters of the last quarter, first and last included.
    pub marks: [f64; 5],
    /// The most that the torso rose, metres, and how far it was tilted then, radians.
    pub rise: f64,
    /// See there.
    pub apex_tilt: f64,
    /// The most that it rose while no foot (without legs: no part) was on the ground and it was
    /// tilted by less than 1 rad (without legs: however), metres.
    pub airborne_rise: f64,
    /// Whether all feet, and all parts, were off the ground at once after the first touch.
    pub feet_afloat: bool,
    /// See there.
    pub all_afloat: bool,
    /// Share of steps with the torso tilted by less than 1 rad.
    pub upright: f64,
    /// Mean of the torso's tilt, radians.
    pub mean_tilt: f64,
    /// Share of steps with the torso on the ground.
    pub torso_contact: f64,
    /// Share of steps with each leg's foot on the ground.
    pub duty: Vec<f64>,
    /// Standard deviation of each driven joint, radians.
    pub deviation: Vec<f64>,
    /// Work of the motors, |torque · speed| over time, joules.
    pub work: f64,
    /// The most that the torso had turned from the start pose, radians, turns counted.
    pub most_turned: f64,
    /// How often a motor was told to reverse.
    pub reversals: f64,
    /// Share of the motor commands above 95 % of full speed.
    pub saturation: f64,
    /// Over the last half second: the most tilt, radians; the least height, metres; whether the torso
    /// and whether a foot touched the ground; and the share of it in which it stood: upright, its
    /// torso off the ground and above 0.6 of its height, on a foot.
    pub tail_tilt: f64,
    /// See there.
    pub tail_low: f64,
    /// See there.
    pub tail_torso: bool,
    /// See there.
    pub tail_foot: bool,
    /// See there.
    pub tail_stands: f64,
    /// Angles of each driven joint, step by step, if asked for.
    pub angles: Vec<Vec<f32>>,
}

/// Measures episodes of a group as they go.
#[derive(Clone, Debug)]
pub(crate) struct Meter<S: Simd> {
    steps: u32,
    step: u32,
    falls: bool,
    torso: usize,
    feet: Vec<usize>,
    dt: Lanes<S>,
    stand: Lanes<S>,
    start: [Lanes<S>; 2],
    end: [Lanes<S>; 2],
    marks: [Lanes<S>; 5],
    alive: Mask<S>,
    lived: Lanes<S>,
    highest: Lanes<S>,
    apex_tilt: Lanes<S>,
    airborne: Lanes<S>,
    landed: [Mask<S>; 2],
    afloat: [Mask<S>; 2],
    upright: Lanes<S>,
    tilts: Lanes<S>,
    on_torso: Lanes<S>,
    on_feet: Vec<Lanes<S>>,
    sums: Vec<[Lanes<S>; 2]>,
    work: Lanes<S>,
    turned: Lanes<S>,
    most_turned: Lanes<S>,
    last_tilt: Lanes<S>,
    signs: Vec<Lanes<S>>,
    reversals: Lanes<S>,
    saturated: Lanes<S>,
    tail_tilt: Lanes<S>,
    tail_low: Lanes<S>,
    tail_torso: Mask<S>,
    tail_foot: Mask<S>,
    tail_stands: Lanes<S>,
    tail: Lanes<S>,
    series: Option<Vec<Vec<Lanes<S>>>>,
}

impl<S: Simd> Meter<S> {
    /// Of episodes that go so; `bodies`: one for each lane, or for all; `start`: where the torso's
    /// centre is in the start pose.
    pub fn new(
        simd: S,
        bodies: &[&Body],
        dt: Lanes<S>,
        start: [Lanes<S>; 2],
        touching: &[Mask<S>],
        plan: Plan,
    ) -> Self {
        let Plan { steps, falls, series, .. } = plan;
        let (zero, one) = (dt.like(0.0), dt.like(1.0));
        let never = zero.less(zero);
        let body = bodies[0];
        let (joints, legs) = (body.driven().len(), body.legs());
        let tall = |lane: usize| bodies[lane.min(bodies.len() - 1)].standing_height();
        let feet: Vec<_> = legs.iter().map(|leg| leg.foot).collect();
        let on = |parts: &[usize]| parts.iter().fold(never, |on, &part| on | touching[part]);
        let all: Vec<_> = (0..touching.len()).collect();
        Self {
            steps,
            step: 0,
            falls,
            torso: body.torso(),
            dt,
            // Of the torso's centre, to stand: 0.4 of the standing height below its start.
            stand: start[1] - Lanes::from_fn(simd, |lane| 0.4 * tall(lane)),
            start,
            end: start,
            marks: [start[0]; 5],
            alive: zero.less(one),
            lived: zero,
            highest: start[1],
            apex_tilt: zero,
            airborne: start[1],
            landed: [on(&feet), on(&all)],
            feet,
            afloat: [never; 2],
            upright: zero,
            tilts: zero,
            on_torso: zero,
            on_feet: vec![zero; legs.len()],
            sums: vec![[zero; 2]; joints],
            work: zero,
            turned: zero,
            most_turned: zero,
            last_tilt: zero,
            signs: vec![zero; joints],
            reversals: zero,
            saturated: zero,
            tail_tilt: zero,
            tail_low: zero.like(f32::MAX),
            tail_torso: never,
            tail_foot: never,
            tail_stands: zero,
            tail: zero,
            series: series.then(|| vec![Vec::new(); joints]),
        }
    }

    /// After a step; says where episodes go on.
    #[inline(always)]
    pub fn watch(&mut self, look: &Look<'_, S>) -> Mask<S> {
        self.step += 1;
        let zero = self.dt.like(0.0);
        let one = zero.like(1.0);
        let alive = self.alive;
        let [x, y] = look.torso;
        self.lived += alive.one();
        self.end = [alive.choose(x, self.end[0]), alive.choose(y, self.end[1])];
        let (steps, step) = (self.steps as usize, self.step as usize);
        let quarter = steps - steps / 4;
        for (index, mark) in self.marks.iter_mut().enumerate() {
            if step == quarter + index * (steps - quarter) / 4 {
                *mark = self.end[0];
            }
        }

        let tilt = look.tilt.abs();
        let upright = tilt.less(one);
        self.upright += (alive & upright).one();
        self.tilts += alive.keep(tilt);
        let torso_on = look.touching[self.torso];
        self.on_torso += (alive & torso_on).one();
        let mut foot_on = zero.less(zero);
        for leg in 0..self.feet.len() {
            let on = look.touching[self.feet[leg]];
            foot_on = foot_on | on;
            self.on_feet[leg] += (alive & on).one();
        }
        let mut part_on = foot_on;
        for on in look.touching {
            part_on = part_on | *on;
        }
        let legless = self.feet.is_empty();
        self.landed = [self.landed[0] | foot_on, self.landed[1] | part_on];
        self.afloat = [
            self.afloat[0] | (alive & self.landed[0] & !foot_on),
            self.afloat[1] | (alive & self.landed[1] & !part_on),
        ];

        let higher = alive & y.greater(self.highest);
        self.highest = higher.choose(y, self.highest);
        self.apex_tilt = higher.choose(tilt, self.apex_tilt);
        let free = if legless {
            self.landed[1] & !part_on
        } else {
            self.landed[0] & !foot_on & !torso_on & upright
        };
        let higher = alive & free & y.greater(self.airborne);
        self.airborne = higher.choose(y, self.airborne);

        let turn = math::wrap(look.tilt - self.last_tilt);
        self.last_tilt = look.tilt;
        self.turned += alive.keep(turn);
        self.most_turned = self.most_turned.max(self.turned.abs());

        for joint in 0..look.angles.len() {
            let angle = alive.keep(look.angles[joint]);
            self.sums[joint][0] += angle;
            self.sums[joint][1] += angle * angle;
            let command = look.commands[joint];
            let sign = command.greater(zero).choose(one, -one);
            let reversed = (sign * self.signs[joint]).less(zero);
            self.reversals += (alive & reversed).one();
            self.signs[joint] = sign;
            self.saturated += (alive & command.abs().greater(zero.like(0.95))).one();
        }
        let mut power = zero;
        for joint in 0..look.torques.len() {
            power += (look.torques[joint] * look.speeds[joint]).abs();
        }
        self.work += alive.keep(power) * self.dt;
        if let Some(series) = &mut self.series {
            for (series, angle) in series.iter_mut().zip(look.angles) {
                series.push(*angle);
            }
        }

        let left = zero.like((self.steps - self.step.min(self.steps)) as f32) * self.dt;
        let tail = alive & !left.greater(zero.like(TAIL));
        self.tail += tail.one();
        self.tail_tilt = tail.choose(self.tail_tilt.max(tilt), self.tail_tilt);
        self.tail_low = tail.choose(self.tail_low.min(y), self.tail_low);
        self.tail_torso = self.tail_torso | (tail & torso_on);
        self.tail_foot = self.tail_foot | (tail & foot_on);
        let stands = upright & !torso_on & foot_on & !y.less(self.stand);
        self.tail_stands += (tail & stands).one();

        if self.falls {
            let fallen = if legless { !upright } else { !upright | torso_on };
            self.alive = self.alive & !fallen;
        }
        self.alive
    }

    /// What was measured in a lane.
    pub fn tally(&self, lane: usize) -> Tally {
        let of = |value: Lanes<S>| f64::from(value.lane(lane));
        let lived = of(self.lived);
        let share = |value: Lanes<S>| of(value) / lived.max(1.0);
        let deviation = |[sum, squares]: &[Lanes<S>; 2]| {
            (share(*squares) - share(*sum).powi(2)).max(0.0).sqrt()
        };
        let joints = self.sums.len() as f64;
        let steps = self.lived.lane(lane) as usize;
        let series = |all: &Vec<Lanes<S>>| all.iter().take(steps).map(|a| a.lane(lane)).collect();
        // Where an episode was over before, as if it had gone on and nothing had moved.
        let lead = self.steps / 4;
        let mark = |index: usize| {
            let reached = self.step >= self.steps - lead + index as u32 * lead / 4;
            of(if reached { self.marks[index] } else { self.end[0] })
        };
        Tally {
            steps: f64::from(self.steps),
            lived,
            dt: of(self.dt),
            start: self.start.map(of),
            end: self.end.map(of),
            marks: [0, 1, 2, 3, 4].map(mark),
            rise: of(self.highest) - of(self.start[1]),
            apex_tilt: of(self.apex_tilt),
            airborne_rise: of(self.airborne) - of(self.start[1]),
            feet_afloat: self.afloat[0].lane(lane),
            all_afloat: self.afloat[1].lane(lane),
            upright: share(self.upright),
            mean_tilt: share(self.tilts),
            torso_contact: share(self.on_torso),
            duty: self.on_feet.iter().map(|on| share(*on)).collect(),
            deviation: self.sums.iter().map(deviation).collect(),
            work: of(self.work),
            most_turned: of(self.most_turned),
            reversals: of(self.reversals),
            saturation: share(self.saturated) / joints.max(1.0),
            tail_tilt: of(self.tail_tilt),
            tail_low: of(self.tail_low),
            tail_torso: self.tail_torso.lane(lane),
            tail_foot: self.tail_foot.lane(lane),
            tail_stands: of(self.tail_stands) / of(self.tail).max(1.0),
            angles: self.series.iter().flatten().map(series).collect(),
        }
    }
}

impl Tally {
    /// How far forward it got, metres.
    pub fn distance(&self) -> f64 {
        self.end[0] - self.start[0]
    }

    /// Forward speed over all the steps that the episode was to have, metres a second.
    pub fn speed(&self) -> f64 {
        self.distance() / (self.steps * self.dt)
    }

    /// Speeds in the four quarters of the last quarter, metres a second.
    pub fn last_speeds(&self) -> [f64; 4] {
        let (steps, lead) = (self.steps as usize, self.steps as usize / 4);
        let at = |index: usize| steps - lead + index * lead / 4;
        [0, 1, 2, 3].map(|i| {
            let time = (at(i + 1) - at(i)).max(1) as f64 * self.dt;
            (self.marks[i + 1] - self.marks[i]) / time
        })
    }

    /// Speed over the last quarter, metres a second.
    pub fn last_speed(&self) -> f64 {
        let lead = (self.steps as usize / 4).max(1) as f64;
        (self.marks[4] - self.marks[0]) / (lead * self.dt)
    }

    /// Mean power of the motors, |torque · speed|, watts.
    pub fn power(&self) -> f64 {
        self.work / (self.lived.max(1.0) * self.dt)
    }

    /// Share of the episode before a fall.
    pub fn alive(&self) -> f64 {
        self.lived / self.steps.max(1.0)
    }

    /// How much each leg is used, 0 to 1: min(1, sd/0.2) · min(1, duty/0.15) ·
    /// min(1, (1 − duty)/0.15), sd the greatest deviation of its joints. Without legs, min(1, sd/0.2)
    /// of each joint.
    pub fn uses(&self, body: &Body) -> Vec<f64> {
        if body.legs().is_empty() {
            return self.deviation.iter().map(|sd| (sd / 0.2).min(1.0)).collect();
        }
        let legs = body.legs().iter().zip(&self.duty);
        let of = |(leg, &duty): (&ambulo_body::Leg, &f64)| {
            let sd = leg.joints.iter().map(|&joint| self.deviation[joint]).fold(0.0, f64::max);
            (sd / 0.2).min(1.0) * (duty / 0.15).min(1.0) * ((1.0 - duty) / 0.15).min(1.0)
        };
        legs.map(of).collect()
    }

    /// Symmetry of paired joints over the whole episode, 0 to 1; 0 without pairs, period or angles.
    pub fn symmetry(&self, body: &Body) -> f64 {
        let dt = self.dt as f32;
        let (_, period) = measures::regularity(&self.angles, dt);
        measures::symmetry(&self.angles, body.pairs(), period, dt).unwrap_or(0.0)
    }
}
