//! Plays a [`Motion`]: time, phases, events and the root's way over the ground.

use std::sync::Arc;

use ambulo_rig::Pose;
use serde::{Deserialize, Serialize};

use crate::Refused;
use crate::motion::{GroundStep, Mark, Motion, Phase};
use crate::refused::check_number;

/// Greatest factor on the clip's own speed, either way; more is a mistake.
const FASTEST: f32 = 100.0;

/// Longest step, seconds; more is a mistake.
const LONGEST: f32 = 3600.0;

/// Metres a second; a clip whose root is slower does not walk.
const STANDING: f32 = 0.01;

/// How a motion is played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Playback {
    /// From the end on at the start again; else it is held at the end.
    pub looped: bool,
    /// Poses have the root where the clip has it, for clips that are drawn at an object; else it
    /// stands over the origin, turned as at the clip's start, and [`Played::root`] says how it goes.
    pub keep_root: bool,
    /// Factor on the clip's own speed, −100 to 100; less than 0 plays it backward.
    pub speed: f32,
}

impl Default for Playback {
    fn default() -> Self {
        Self { looped: false, keep_root: false, speed: 1.0 }
    }
}

/// A moment of a motion that may loop: rounds are counted from the step's first.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Moment {
    round: i64,
    time: f64,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Played {
    /// How the root went over the ground, in the frame that stood under it before the step.
    pub root: GroundStep,
    /// Whether it is held at the end that it was played towards.
    pub ended: bool,
    from: Moment,
    to: Moment,
    /// Nothing was played before, so that what is at the very start counts too.
    fresh: bool,
}

impl Played {
    /// Whether a moment was passed: each once, whichever way and wherever steps end.
    fn passed(&self, at: Moment) -> bool {
        let between = if self.from <= self.to {
            self.from < at && at <= self.to
        } else {
            self.to <= at && at < self.from
        };
        between || (self.fresh && self.from != self.to && at == self.from)
    }

    /// The events of the motion that was played, in the order in which the step passed them; of
    /// several rounds each time. Allocates nothing.
    pub fn events(self, motion: &Motion) -> impl Iterator<Item = &Mark> {
        let events = &motion.marks().events;
        let forward = self.from <= self.to;
        let first = self.from.round.min(self.to.round);
        // An event at the clip's end is passed when the next round starts: one round more each way.
        let rounds = self.from.round.abs_diff(self.to.round) as usize + 3;
        let count = rounds * events.len();
        (0..count).filter_map(move |index| {
            let index = if forward { index } else { count - 1 - index };
            let (round, event) = (index / events.len(), &events[index % events.len()]);
            let at = Moment { round: first + round as i64 - 1, time: event.time };
            self.passed(at).then_some(event)
        })
    }
}

/// One character's way through a motion.
#[derive(Clone, Debug)]
pub struct Player {
    motion: Arc<Motion>,
    playback: Playback,
    /// Seconds from the clip's start; less than its duration, if it loops.
    time: f64,
    fresh: bool,
}

impl Player {
    /// At the start, or at the end if it is played backward.
    ///
    /// # Errors
    /// A speed beyond ±100.
    pub fn new(motion: Arc<Motion>, playback: Playback) -> Result<Self, Refused> {
        check_number(playback.speed, -FASTEST, FASTEST)?;
        let time = if playback.speed < 0.0 { motion.duration() } else { 0.0 };
        Ok(Self { motion, playback, time, fresh: true })
    }

    /// Moves on by `dt` seconds times the speed. Allocates nothing.
    ///
    /// # Errors
    /// A `dt` that is negative, not finite or longer than an hour; then nothing has changed.
    pub fn step(&mut self, dt: f32) -> Result<Played, Refused> {
        if !(0.0..=LONGEST).contains(&dt) {
            return Err(Refused::Time(dt));
        }
        let duration = self.motion.duration();
        let by = f64::from(dt) * f64::from(self.playback.speed);
        let from = Moment { round: 0, time: self.time };
        let later = self.time + by;
        let to = match self.playback.looped {
            // The end of a round is not yet the start of the next.
            _ if later == self.time => from,
            true if duration > 0.0 => around(later, duration),
            _ => Moment { round: 0, time: later.clamp(0.0, duration) },
        };
        let end = if self.playback.speed < 0.0 { 0.0 } else { duration };
        let played = Played {
            root: self.motion.way_between(from.time, to.time, to.round - from.round),
            ended: !self.playback.looped && to.time == end,
            from,
            to,
            fresh: self.fresh,
        };
        self.fresh &= from == to;
        self.time = to.time;
        Ok(played)
    }

    /// Writes the pose at this moment. Allocates nothing when `out` has the joints.
    pub fn pose(&self, out: &mut Pose) {
        match self.playback.keep_root {
            true => self.motion.as_recorded(self.time, out),
            false => self.motion.in_place(self.time, out),
        }
    }

    /// What is played.
    pub fn motion(&self) -> &Arc<Motion> {
        &self.motion
    }

    /// Seconds from the clip's start.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Jumps to a time, held within the clip; events on the way are not passed, one at that very
    /// time is by the next step.
    ///
    /// # Errors
    /// A time that is not a number.
    pub fn seek(&mut self, time: f64) -> Result<(), Refused> {
        if time.is_nan() {
            return Err(Refused::Time(time as f32));
        }
        self.time = time.clamp(0.0, self.motion.duration());
        self.fresh = true;
        Ok(())
    }

    /// The first phase that this moment lies in.
    pub fn phase(&self) -> Option<&Phase> {
        let phases = &self.motion.marks().phases;
        phases.iter().find(|phase| (phase.start..=phase.end).contains(&self.time))
    }

    /// Factor on the clip's own speed.
    pub fn speed(&self) -> f32 {
        self.playback.speed
    }

    /// Sets the factor on the clip's own speed, −100 to 100.
    ///
    /// # Errors
    /// A number beyond; then nothing has changed.
    pub fn set_speed(&mut self, speed: f32) -> Result<(), Refused> {
        check_number(speed, -FASTEST, FASTEST)?;
        self.playback.speed = speed;
        Ok(())
    }

    /// Matches strides: sets the speed at which the clip's root goes over the ground with `asked`
    /// metres a second, as near as a range of factors allows (legs look rushed or slowed beyond
    /// about 0.7 to 1.4), and returns it. A clip that stands has the factor nearest to 1.
    ///
    /// # Errors
    /// A speed that is not finite or negative, a range that is empty or beyond 0 to 100.
    pub fn match_speed(&mut self, asked: f32, [least, most]: [f32; 2]) -> Result<f32, Refused> {
        check_number(asked, 0.0, f32::MAX)?;
        check_number(most, 0.0, FASTEST)?;
        check_number(least, 0.0, most)?;
        let own = self.motion.ground_speed();
        let factor = if own > STANDING { asked / own } else { 1.0 };
        self.playback.speed = factor.clamp(least, most);
        Ok(self.playback.speed)
    }
}

/// A time that may lie beyond either end of a motion that loops.
fn around(time: f64, duration: f64) -> Moment {
    let round = (time / duration).floor();
    // Rounding may leave it just outside.
    let time = time - round * duration;
    let (round, time) = if time >= duration { (round + 1.0, 0.0) } else { (round, time.max(0.0)) };
    Moment { round: round as i64, time }
}

#[cfg(test)]
mod tests;
