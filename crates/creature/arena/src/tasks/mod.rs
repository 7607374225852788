//! Tasks, one file each, always in the same order: what is asked for, how long, what counts, when
//! it is done well enough to be used.

mod jump;
mod run;

use crate::judge::{Judgement, Seen};
use crate::{ArenaError, Term};

pub use jump::Jump;
pub use run::Run;

/// Something that a creature shall learn.
pub trait Task: Sync {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// What is asked for, in a line.
    fn about(&self) -> &'static str;
    /// Physics steps of an episode.
    fn steps(&self) -> u32;
    /// What counts, and how much.
    fn weights(&self) -> &'static [(Term, f64)];
    /// Why a recorded motion is not usable; nothing if it is. Adds the task's own figures.
    fn reasons(&self, seen: &Seen<'_>, judgement: &mut Judgement) -> Vec<String>;
}

/// All tasks: registered here, and tested, listed and documented everywhere.
pub const TASKS: [&dyn Task; 2] = [&Run, &Jump];

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
