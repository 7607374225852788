//! Where creatures are tried: tasks, the parallel evaluator, recorded episodes, the judgement.
//!
//! An [`Arena`] is a body, a kind of controller, a world and a task. It gives every genome a fitness
//! that depends on nothing else: not on the other genomes, not on the number of threads. A
//! recording of the same genome repeats it to the last bit. An [`Evolution`] is a search in it, to be
//! stepped generation by generation; a [`Learner`] does the same in portions, between the frames of a
//! game.

mod arena;
mod episode;
mod evolution;
mod judge;
mod learner;
mod lesson;
mod measures;
mod meter;
mod record;
mod settings;
mod tasks;
mod terms;
mod trials;

pub use arena::{Arena, ArenaError, Robustness, Score};
pub use evolution::{Champion, Evolution, Told, Until};
pub use judge::{Foot, Judgement};
pub use learner::Learner;
pub use lesson::{Lesson, Round};
pub use meter::Tally;
pub use record::Rollout;
pub use settings::{Preset, SearchSettings, Settings, TaskSettings};
pub use tasks::{TASKS, Task, task};
pub use terms::{Term, Terms};
