//! Where creatures are tried: tasks, the parallel evaluator, recorded episodes, the judgement.
//!
//! An [`Arena`] is a body, a kind of controller, a world and a task. It gives every genome a fitness
//! that depends on nothing else: not on the other genomes, not on the number of threads. A
//! recording of the same genome repeats it to the last bit.

mod arena;
mod episode;
mod judge;
mod measures;
mod record;
mod settings;
mod tasks;
mod terms;

pub use arena::{Arena, ArenaError, Score};
pub use judge::{Foot, Judgement};
pub use record::Rollout;
pub use settings::{Settings, TaskSettings};
pub use tasks::{TASKS, Task, task};
pub use terms::{Term, Terms};
