//! Tasks, one file each, always in the same order: what is asked for, how long, what counts, when
//! it is done well enough to be used.

mod climb;
mod holes;
mod hurdles;
mod jump;
mod keep_upright;
mod rough;
mod run;
mod swim;

use ambulo_body::{Body, Sensor};
use ambulo_pilot::Kind;
use ambulo_world::{Ground, Physics};

use crate::meter::Tally;
use crate::settings::JUDGED;
use crate::{ArenaError, Term};

pub use climb::Climb;
pub use holes::Holes;
pub use hurdles::Hurdles;
pub use jump::Jump;
pub use keep_upright::KeepUpright;
pub use rough::Rough;
pub use run::Run;
pub use swim::Swim;

/// Something that a creature shall learn. What a task does not say is as for a run.
pub trait Task: Sync {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// What is asked for, in a line.
    fn about(&self) -> &'static str;
    /// Physics steps of an episode in the seed's protocol.
    fn steps(&self) -> u32 {
        2000
    }
    /// What counts in the seed's protocol, and how much.
    fn weights(&self) -> &'static [(Term, f64)] {
        &[(Term::Distance, 1.0)]
    }
    /// Physics steps of an episode otherwise, and of the first, shorter ones.
    fn natural_steps(&self) -> u32 {
        JUDGED
    }
    /// See there.
    fn grow(&self) -> &'static [u32];
    /// Whether an episode ends at a fall.
    fn falls(&self) -> bool {
        true
    }
    /// The kind of controller that learns it soonest.
    fn controller(&self) -> Kind {
        Kind::Oscillator
    }
    /// How well it is done the way a creature would do it: about 1 and more is good.
    fn natural(&self, tally: &Tally, body: &Body, gravity: f64) -> f64 {
        run::natural(tally, body, gravity)
    }
    /// The laws of its world, from those that were asked for: the ground is the task's own where only
    /// level ground was asked for.
    fn world(&self, asked: Physics) -> Physics {
        asked
    }
    /// What its controllers are told, if it asks for more than the creature's file.
    fn sensors(&self) -> Option<Vec<Sensor>> {
        None
    }
    /// Whether the torso is pushed in training, too.
    fn pushed(&self) -> bool {
        false
    }
    /// How far the torso must rise, metres, where that is asked for.
    fn rise_needed(&self, _: &Body) -> Option<f64> {
        None
    }
    /// Whether an episode, short as it may be, says nothing against the motion: those are worth a
    /// replay, and a longer episode.
    fn promising(&self, tally: &Tally, body: &Body) -> bool {
        Run.reasons(tally, body).is_empty()
    }
    /// Why a motion is not usable; nothing if it is.
    fn reasons(&self, tally: &Tally, body: &Body) -> Vec<String>;
}

/// All tasks: registered here, and tested, listed and documented everywhere.
pub const TASKS: [&dyn Task; 8] =
    [&Run, &Jump, &Climb, &Hurdles, &Holes, &Rough, &KeepUpright, &Swim];

/// The world that was asked for, with the task's own ground where only level ground was.
fn on(ground: Ground, asked: Physics) -> Physics {
    match asked.ground {
        Ground::Flat => Physics { ground, ..asked },
        _ => asked,
    }
}

/// Why a motion is no usable run that has got so far, metres from the start.
fn run_past(needed: f64, tally: &Tally, body: &Body) -> Vec<String> {
    let mut reasons = Run.reasons(tally, body);
    let distance = tally.distance();
    if distance <= needed {
        reasons.push(format!("it got {distance:.1} m far, {needed:.1} are needed"));
    }
    reasons
}

/// Posture, contacts and the ground ahead, for those who must see what comes.
fn seeing() -> Option<Vec<Sensor>> {
    Some(vec![
        Sensor::TorsoRotation,
        Sensor::JointAngles,
        Sensor::FootContacts,
        Sensor::GroundRays { count: 6, reach: 1.5 },
    ])
}

/// A task by its name.
///
/// # Errors
/// A name that no task has.
pub fn task(name: &str) -> Result<&'static dyn Task, ArenaError> {
    TASKS.into_iter().find(|task| task.name() == name).ok_or_else(|| {
        let known: Vec<_> = TASKS.iter().map(|task| task.name()).collect();
        ArenaError::Settings(format!(
            "task.name: no task is called '{name}'; there are {}",
            known.join(", ")
        ))
    })
}
