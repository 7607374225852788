//! What is learned before a task: incremental evolution, as in Gomez, Miikkulainen, "Incremental
//! Evolution of Complex General Behavior" (1997).

use ambulo_world::Ground;
use serde::{Deserialize, Serialize};

use crate::{Settings, TaskSettings, Until};

/// An easier task. The search goes on with the same genomes when its champion is what is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of settings")]
pub struct Lesson {
    /// Which task. Default: the search's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<String>,
    /// Shape of the ground. Default: of the same task the search's own, else as that task has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<Ground>,
    /// Physics steps of an episode. Default: as the task has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// What the champion must be, so that the next one begins.
    pub until: Until,
}

impl Lesson {
    /// What is searched for in this lesson, of a search with everything said.
    pub(crate) fn settings(&self, whole: &Settings) -> Settings {
        let own = whole.task.name.clone();
        let name = self.task.clone().unwrap_or_else(|| own.clone());
        let ground =
            self.ground.unwrap_or(if name == own { whole.world.ground } else { Ground::Flat });
        Settings {
            task: TaskSettings { name, steps: self.steps, ..TaskSettings::default() },
            world: ambulo_world::Physics { ground, ..whole.world },
            curriculum: Vec::new(),
            ..whole.clone()
        }
    }
}

/// How a generation is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Round {
    /// How many lessons are ahead of the task itself.
    pub ahead: usize,
    /// Physics steps of its episodes.
    pub steps: u32,
    /// Seed of the other physics under which all are tried, too, if they are.
    pub draw: Option<u64>,
}
