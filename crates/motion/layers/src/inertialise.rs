//! The way from one source of poses to any other without a pop and without running both.
//!
//! On a switch the offset between what was shown and what the new source says, and its speed, are
//! taken over; the new source plus what is left of the offset is shown until nothing is. The offset
//! comes from the shown poses alone, so a switch may come at any frame, also in the middle of
//! another transition.
//!
//! Sources: Bollo, "Inertialization: High-Performance Animation Transitions in 'Gears of War'" (GDC
//! 2018); Holden, "Spring-It-On: The Game Developer's Spring-Roll-Call" (theorangeduck.com, 2020).

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Transform};
use serde::{Deserialize, Serialize};

use crate::Refused;
use crate::refused::{check, check_number};
use crate::rotation::shorter;
use crate::smooth::spring;

/// Metres or radians below which an offset has no direction: it is rounding.
const NOISE: f32 = 1e-4;

/// After so many half-lives a spring's offset is 2⁻³² of what it was.
const SPRING_END: f32 = 16.0;

/// Longest duration or half-life, seconds; more is a mistake.
const LONGEST: f32 = 60.0;

/// Seconds; what ends sooner jumps.
const SHORTEST: f32 = 1e-6;

/// Metres or radians a second; what is faster did not move but was put elsewhere.
const FASTEST: f32 = 1e9;

/// How an offset goes to nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Decay {
    /// By a polynomial of the fifth degree, which ends at rest after `duration` seconds. An offset
    /// that is on its way to nothing already is there at its own speed, if that is sooner, so that it
    /// never overshoots.
    Quintic {
        /// Seconds; 0 jumps.
        duration: f32,
    },
    /// As a critically damped spring: never quite at its end, and past it if it was on its way too
    /// quickly.
    Spring {
        /// Seconds; 0 jumps.
        halflife: f32,
    },
}

impl Default for Decay {
    fn default() -> Self {
        Self::Quintic { duration: 0.3 }
    }
}

impl Decay {
    /// Seconds after which nothing is left.
    fn end(self) -> f32 {
        match self {
            Self::Quintic { duration } => duration,
            Self::Spring { halflife } => SPRING_END * halflife,
        }
    }

    /// What is left after `t` seconds of an offset `x` with velocity `v`.
    fn left(self, x: Vec3, v: Vec3, t: f32) -> Vec3 {
        match self {
            _ if t >= self.end() || self.end() < SHORTEST => Vec3::ZERO,
            Self::Quintic { duration } => quintic(x, v, duration, t),
            Self::Spring { halflife } => spring(x, v, Vec3::ZERO, halflife, t).0,
        }
    }
}

/// Bollo's curve along the offset. He drops the velocity across it and away from 0, which shows as
/// a jolt; here those come to rest by the same polynomial, so that the velocity never jumps.
fn quintic(x: Vec3, v: Vec3, duration: f32, t: f32) -> Vec3 {
    let distance = x.length();
    if distance < NOISE {
        return ending(x, v, Vec3::ZERO, duration, t);
    }
    let direction = x / distance;
    let speed = v.dot(direction);
    let across = ending(Vec3::ZERO, v - direction * speed, Vec3::ZERO, duration, t);
    // t1 ≤ −5 x / v, and the acceleration at the start a ≥ 0: else the curve would cross 0.
    let t1 = if speed < 0.0 { duration.min(-5.0 * distance / speed) } else { duration };
    let a = ((-8.0 * speed * t1 - 20.0 * distance) / (t1 * t1)).max(0.0);
    across + ending(x, direction * speed, direction * a, t1, t)
}

/// The polynomial of the fifth degree from position `x`, velocity `v` and acceleration `a` to rest
/// at 0 at `t1`.
fn ending(x: Vec3, v: Vec3, a: Vec3, t1: f32, t: f32) -> Vec3 {
    if t >= t1 {
        return Vec3::ZERO;
    }
    let s = t / t1;
    let start = x * (1.0 + s * (3.0 + 6.0 * s)) + v * (t * (1.0 + 3.0 * s)) + a * (0.5 * t * t);
    start * (1.0 - s).powi(3)
}

/// What was shown less what the source says, at the switch: metres and, in the frame of the joint's
/// parent, a rotation vector in radians; with their velocities.
#[derive(Clone, Copy, Debug, Default)]
struct Offset {
    place: Vec3,
    place_velocity: Vec3,
    turn: Vec3,
    turn_velocity: Vec3,
}

impl Offset {
    /// Between the joint as shown (`shown`, and `coming`: where its own motion would have it `dt`
    /// later) and the same two of the source.
    fn new(
        shown: Transform,
        coming: Transform,
        source: Transform,
        next: Transform,
        dt: f32,
    ) -> Self {
        let place = shown.translation - source.translation;
        let turn = shorter(shown.rotation * source.rotation.inverse());
        let turned = coming.rotation * next.rotation.inverse();
        // The same way round as the first, even if that is now the longer one.
        let turned = if turned.dot(turn) < 0.0 { -turned } else { turned };
        let turn = turn.to_scaled_axis();
        let velocity = |difference: Vec3| {
            let velocity = difference / dt;
            // NaN is not slower than anything.
            if velocity.length_squared() < FASTEST * FASTEST { velocity } else { Vec3::ZERO }
        };
        Self {
            place,
            place_velocity: velocity(coming.translation - next.translation - place),
            turn,
            turn_velocity: velocity(turned.to_scaled_axis() - turn),
        }
    }

    fn added(&self, source: Transform, decay: Decay, t: f32) -> Transform {
        let turn = decay.left(self.turn, self.turn_velocity, t);
        Transform {
            translation: source.translation + decay.left(self.place, self.place_velocity, t),
            rotation: (Quat::from_scaled_axis(turn) * source.rotation).normalize(),
        }
    }
}

/// Shows one source of poses at a time and makes every switch smooth.
///
/// Each frame: [`switch`](Self::switch) if the source changed, then [`step`](Self::step).
#[derive(Clone, Debug)]
pub struct Inertialiser {
    decay: Decay,
    offsets: Vec<Offset>,
    /// Of the transition that runs, with the seconds since its switch; `None` when nothing is left.
    running: Option<(Decay, f32)>,
    /// The last pose handed out and the one before it, with the seconds between them.
    shown: Pose,
    before: Pose,
    between: f32,
    /// How many of those two there are.
    known: u8,
}

impl Inertialiser {
    /// For poses of so many joints; none was shown yet.
    ///
    /// # Errors
    /// A duration or half-life that is negative, not finite or longer than a minute.
    pub fn new(joints: usize, decay: Decay) -> Result<Self, Refused> {
        let pose = Pose { local: vec![Transform::IDENTITY; joints] };
        let mut new = Self {
            decay: Decay::default(),
            offsets: vec![Offset::default(); joints],
            running: None,
            shown: pose.clone(),
            before: pose,
            between: 0.0,
            known: 0,
        };
        new.set_decay(decay)?;
        Ok(new)
    }

    /// From the next switch on.
    ///
    /// # Errors
    /// As in [`new`](Self::new).
    pub fn set_decay(&mut self, decay: Decay) -> Result<(), Refused> {
        let (Decay::Quintic { duration: time } | Decay::Spring { halflife: time }) = decay;
        check_number(time, 0.0, LONGEST)?;
        self.decay = decay;
        Ok(())
    }

    /// Starts the transition to another source: `source` is its pose at the moment that was shown
    /// last, `next` the one `dt` seconds later; twice the same, if it has only one (its velocity then
    /// comes as a jolt, but nothing pops). A second switch before the next step replaces the first.
    /// Before any pose was shown there is nothing to do.
    ///
    /// # Errors
    /// A pose with other joints or with a number that is not finite, a `dt` that is not positive;
    /// then nothing has changed: stay with the old source, or the next step pops.
    pub fn switch(&mut self, source: &Pose, next: &Pose, dt: f32) -> Result<(), Refused> {
        check(source, self.offsets.len())?;
        check(next, self.offsets.len())?;
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(Refused::Time(dt));
        }
        if self.known == 0 {
            return Ok(());
        }
        let ahead = if self.known > 1 { dt / self.between } else { 0.0 };
        let shown = self.shown.local.iter().zip(&self.before.local);
        let sources = source.local.iter().zip(&next.local);
        for ((offset, (&shown, before)), (&source, &next)) in
            self.offsets.iter_mut().zip(shown).zip(sources)
        {
            let turn = shorter(shown.rotation * before.rotation.inverse()).to_scaled_axis();
            let coming = Transform {
                translation: shown.translation + (shown.translation - before.translation) * ahead,
                rotation: Quat::from_scaled_axis(turn * ahead) * shown.rotation,
            };
            *offset = Offset::new(shown, coming, source, next, dt);
        }
        self.running = Some((self.decay, 0.0));
        Ok(())
    }

    /// `dt` seconds later: the source's pose with what is left of the offset. A `dt` of 0 changes
    /// nothing and hands out the same pose again. Allocates nothing when `out` has the joints.
    ///
    /// # Errors
    /// A pose with other joints or with a number that is not finite, a `dt` that is negative or not
    /// finite; then neither the state nor `out` has changed.
    pub fn step(&mut self, source: &Pose, dt: f32, out: &mut Pose) -> Result<(), Refused> {
        check(source, self.offsets.len())?;
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(Refused::Time(dt));
        }
        if dt > 0.0 || self.known == 0 {
            self.advance(source, dt);
        }
        out.local.clone_from(&self.shown.local);
        Ok(())
    }

    fn advance(&mut self, source: &Pose, dt: f32) {
        std::mem::swap(&mut self.before, &mut self.shown);
        let later = self.running.map(|(decay, since)| (decay, since + dt));
        self.running = later.filter(|(decay, since)| *since < decay.end());
        match self.running {
            Some((decay, since)) => {
                let joints = self.shown.local.iter_mut().zip(&source.local).zip(&self.offsets);
                joints.for_each(|((out, &from), offset)| *out = offset.added(from, decay, since));
            }
            None => self.shown.local.copy_from_slice(&source.local),
        }
        self.between = dt;
        self.known = 2.min(self.known + 1);
    }

    /// Says what was shown instead of the pose that the last [`step`](Self::step) handed out, after
    /// other layers: the next switch starts from there, at its speed. Without it, what they added
    /// would be gone with their weights.
    ///
    /// # Errors
    /// A pose with other joints or with a number that is not finite; then nothing has changed.
    pub fn shown_instead(&mut self, pose: &Pose) -> Result<(), Refused> {
        check(pose, self.offsets.len())?;
        self.shown.local.clone_from(&pose.local);
        Ok(())
    }

    /// Whether something is left of an offset.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Forgets what was shown: the next step shows its source as it is. After a teleport.
    pub fn reset(&mut self) {
        (self.running, self.known) = (None, 0);
    }
}

#[cfg(test)]
mod tests;
