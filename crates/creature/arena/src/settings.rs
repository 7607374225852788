//! Everything about a search but the creature.

use std::collections::BTreeMap;

use ambulo_evolve::GeneticSettings;
use ambulo_pilot::Settings as ControllerSettings;
use ambulo_world::Physics;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use crate::tasks::{Task, task};
use crate::{ArenaError, Term};

/// What is to be done and what counts; what is left out is as the task has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct TaskSettings {
    /// Which task; `ambulo evolve` fills it in.
    pub name: String,
    /// Physics steps of an episode, 1 to 1000000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// Whether an episode ends at a fall: the torso tilts by more than 1 rad, or touches the ground
    /// though there are legs. What was reached until then counts.
    pub end_on_fall: bool,
    /// Fitness is the sum of these times the terms of the same names; negative ones are penalties.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "weights")]
    pub weights: Option<BTreeMap<Term, f64>>,
}

/// Weights by the terms' names, so that an unknown one is told by name.
fn weights<'de, D: Deserializer<'de>>(from: D) -> Result<Option<BTreeMap<Term, f64>>, D::Error> {
    let Some(named) = Option::<BTreeMap<String, f64>>::deserialize(from)? else { return Ok(None) };
    let term = |(name, weight): (String, f64)| {
        let found = Term::ALL.into_iter().find(|term| term.name() == name);
        found.map(|term| (term, weight)).ok_or_else(|| {
            let known = Term::ALL.map(Term::name).join(", ");
            D::Error::custom(format!("no term is called '{name}'; there are {known}"))
        })
    };
    named.into_iter().map(term).collect::<Result<_, _>>().map(Some)
}

/// A search, all but the creature; every field has a default, the seed's where it has one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Settings {
    /// How many generations, 1 to 10 million. The seed's: 300.
    pub generations: u64,
    /// Of everything random.
    pub seed: u64,
    /// The kind of controller.
    pub controller: ControllerSettings,
    /// The strategy: the seed's genetic algorithm.
    pub evolution: GeneticSettings,
    /// The laws of the world.
    pub world: Physics,
    /// The task.
    pub task: TaskSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            generations: 300,
            seed: 1,
            controller: ControllerSettings::default(),
            evolution: GeneticSettings::default(),
            world: Physics::default(),
            task: TaskSettings::default(),
        }
    }
}

impl Settings {
    /// Reads settings as JSON.
    ///
    /// # Errors
    /// A field that is not known or of another type, with its path.
    pub fn parse(json: &str) -> Result<Self, ArenaError> {
        let value: serde_json::Value = serde_json::from_str(json)
            .map_err(|error| ArenaError::Settings(format!("not JSON: {error}")))?;
        serde_path_to_error::deserialize(value).map_err(|error| {
            let path = error.path().to_string();
            ArenaError::Settings(format!("{path}: {}", error.into_inner()))
        })
    }

    /// The task, and its settings with everything said.
    ///
    /// # Errors
    /// A task that is not known, a number out of range.
    pub(crate) fn task(&self) -> Result<(&'static dyn Task, TaskSettings), ArenaError> {
        let found = task(&self.task.name)?;
        let steps = self.task.steps.unwrap_or(found.steps());
        if !(1..=1_000_000).contains(&steps) {
            return Err(ArenaError::Settings(format!("task.steps: {steps} is not 1 to 1000000")));
        }
        if !(1..=10_000_000).contains(&self.generations) {
            let generations = self.generations;
            let reason = format!("generations: {generations} is not 1 to 10000000");
            return Err(ArenaError::Settings(reason));
        }
        let weights = match &self.task.weights {
            Some(weights) => weights.clone(),
            None => found.weights().iter().copied().collect(),
        };
        if let Some((term, weight)) = weights.iter().find(|(_, weight)| !weight.is_finite()) {
            let name = term.name();
            return Err(ArenaError::Settings(format!(
                "task.weights.{name}: {weight} is not finite"
            )));
        }
        let resolved = TaskSettings {
            name: found.name().into(),
            steps: Some(steps),
            end_on_fall: self.task.end_on_fall,
            weights: Some(weights),
        };
        Ok((found, resolved))
    }
}
