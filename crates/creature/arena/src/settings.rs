//! Everything about a search but the creature.

use std::collections::BTreeMap;

use ambulo_body::{Body, Morphology};
use ambulo_evolve::{EsSettings, GeneticSettings, NeatSettings, StrategySettings};
use ambulo_pilot::{Kind, Pilot, Settings as ControllerSettings};
use ambulo_world::Physics;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use crate::tasks::{Task, task};
use crate::{ArenaError, Lesson, Term};

/// Steps on which motions are judged.
pub(crate) const JUDGED: u32 = 2000;

/// What is to be done and what counts; what is left out is as the task has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct TaskSettings {
    /// Which task; `ambulo evolve` fills it in.
    pub name: String,
    /// Physics steps of an episode, 1 to 1000000. Default: as the task has it; the seed's protocol has
    /// 2000 for runs and 500 for jumps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// Shorter episodes to begin with, in steps: each one is left when the best does not fall any
    /// more and does nothing that makes it unusable. Default: none if `steps` is said, else as the
    /// task has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grow: Option<Vec<u32>>,
    /// Whether an episode ends at a fall: the torso tilts by more than 1 rad, or touches the ground
    /// though there are legs. What was reached until then counts. Default: yes where the task is to
    /// get along, in the seed's protocol no.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_on_fall: Option<bool>,
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

/// Where settings that are left out come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// A gait in seconds: the task's natural fitness and kind of controller, episodes that end at a
    /// fall and grow, champions chosen on replays.
    #[default]
    Natural,
    /// The seed's protocol: network, genetic algorithm, plain fitness, 300 generations.
    Seed,
}

/// How a champion is chosen and when a search begins anew.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct SearchSettings {
    /// The best so many of a generation, of those whose episodes say nothing against it, are judged
    /// on replays, 0 to 1000; the champion is the one that holds up best under other physics. 0: the
    /// one with the most fitness. Default: 16, in the seed's protocol 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trials: Option<usize>,
    /// A search that does not get better by 1 % for so many generations begins anew, 0 to 1000000; 0:
    /// never. Default: 15, in the seed's protocol 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patience: Option<u64>,
    /// Whether every generation is tried under other physics, too: friction times 0.75 to 1.25, mass,
    /// motor torque and time step times 0.9 to 1.1, with pushes; the worse of both fitnesses counts.
    /// Default: no.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub randomise: Option<bool>,
}

/// A search, all but the creature; every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Settings {
    /// Where what is left out comes from.
    pub preset: Preset,
    /// How many generations, 1 to 10 million. Default: 300.
    pub generations: u64,
    /// Of everything random.
    pub seed: u64,
    /// The kind of controller.
    pub controller: ControllerSettings,
    /// The strategy. Default: (μ, λ)-ES, in the seed's protocol its genetic algorithm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evolution: Option<StrategySettings>,
    /// The laws of the world.
    pub world: Physics,
    /// The task.
    pub task: TaskSettings,
    /// How the champion is chosen.
    pub search: SearchSettings,
    /// What of the body evolves with the controller. Default: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<Morphology>,
    /// What is learned first, in this order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curriculum: Vec<Lesson>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            preset: Preset::Natural,
            generations: 300,
            seed: 1,
            controller: ControllerSettings::default(),
            evolution: None,
            world: Physics::default(),
            task: TaskSettings::default(),
            search: SearchSettings::default(),
            body: None,
            curriculum: Vec::new(),
        }
    }
}

impl Settings {
    /// Reads settings as JSON.
    ///
    /// # Errors
    /// A field that is not known or of another type, with its path.
    pub fn parse(json: &str) -> Result<Self, ArenaError> {
        let mut value: serde_json::Value = serde_json::from_str(json)
            .map_err(|error| ArenaError::Settings(format!("not JSON: {error}")))?;
        // Settings of a strategy that is not named are those of the controller's or the preset's.
        let grows = value.pointer("/controller/kind").is_some_and(|kind| kind == "graph");
        let seed = value.get("preset").is_some_and(|preset| preset == "seed");
        if let Some(evolution) = value.get_mut("evolution").and_then(|part| part.as_object_mut()) {
            let name = if grows {
                "neat"
            } else if seed {
                "genetic"
            } else {
                "es"
            };
            evolution.entry("strategy").or_insert_with(|| name.into());
        }
        serde_path_to_error::deserialize(value).map_err(|error| {
            let path = error.path().to_string();
            ArenaError::Settings(format!("{path}: {}", error.into_inner()))
        })
    }

    /// The task, and the settings with everything said, for a body.
    ///
    /// # Errors
    /// A task that is not known, a number out of range.
    pub(crate) fn resolved(&self, body: &Body) -> Result<(&'static dyn Task, Self), ArenaError> {
        let found = task(&self.task.name)?;
        let natural = self.preset == Preset::Natural;
        let range = |name: &str, value: u64, low: u64, high: u64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(ArenaError::Settings(format!("{name}: {value} is not {low} to {high}")))
        };
        let steps =
            self.task.steps.unwrap_or(if natural { found.natural_steps() } else { found.steps() });
        range("task.steps", steps.into(), 1, 1_000_000)?;
        range("generations", self.generations, 1, 10_000_000)?;
        let grow = self.task.grow.clone().unwrap_or_else(|| {
            let stages = found.grow().iter().copied();
            let shorter = |stage: &u32| natural && self.task.steps.is_none() && *stage < steps;
            stages.filter(shorter).collect()
        });
        if !grow.iter().chain([&steps]).is_sorted() || grow.contains(&0) || grow.len() > 100 {
            return Err(ArenaError::Settings(format!(
                "task.grow: {grow:?} are not up to 100 growing numbers of steps, 1 to {steps}"
            )));
        }
        let weights = match &self.task.weights {
            Some(weights) => weights.clone(),
            None if natural => [(Term::Natural, 1.0)].into_iter().collect(),
            None => found.weights().iter().copied().collect(),
        };
        if let Some((term, weight)) = weights.iter().find(|(_, weight)| !weight.is_finite()) {
            let name = term.name();
            return Err(ArenaError::Settings(format!(
                "task.weights.{name}: {weight} is not finite"
            )));
        }
        let search = SearchSettings {
            trials: Some(self.search.trials.unwrap_or(if natural { 16 } else { 0 })),
            patience: Some(self.search.patience.unwrap_or(if natural { 15 } else { 0 })),
            randomise: Some(self.search.randomise.unwrap_or(false)),
        };
        range("search.trials", search.trials.expect("said") as u64, 0, 1000)?;
        range("search.patience", search.patience.expect("said"), 0, 1_000_000)?;
        range("curriculum", self.curriculum.len() as u64, 0, 100)?;
        if !self.curriculum.is_empty() && search.trials == Some(0) {
            return Err(ArenaError::Settings(
                "curriculum: its lessons end by champions chosen on replays, but search.trials is 0"
                    .into(),
            ));
        }
        if let Some(body_settings) = &self.body {
            let bad = |error| ArenaError::Settings(format!("body.{error}"));
            body_settings.check(body).map_err(bad)?;
        }
        let mut controller = self.controller.clone();
        if matches!(self.evolution, Some(StrategySettings::Neat(_))) {
            controller.kind.get_or_insert(Kind::Graph);
        }
        if natural && controller.kind.is_none() {
            controller.kind = Some(found.controller());
        }
        controller.sensors = controller.sensors.or_else(|| found.sensors());
        let world = found.world(self.world);
        let evolution = self.evolution.clone().unwrap_or_else(|| {
            if controller.kind == Some(Kind::Graph) {
                StrategySettings::Neat(NeatSettings::default())
            } else if natural {
                StrategySettings::Es(EsSettings::default())
            } else {
                StrategySettings::Genetic(GeneticSettings::default())
            }
        });
        let mut evolution = evolution;
        let grows = controller.kind == Some(Kind::Graph);
        match &mut evolution {
            StrategySettings::Neat(_) if self.body.is_some() => {
                return Err(ArenaError::Settings(
                    "body: it evolves with genomes of one length, and neat's are of many".into(),
                ));
            }
            StrategySettings::Neat(neat) if grows => {
                let widths = Pilot::widths(body, &controller)?;
                (neat.inputs, neat.outputs) = (widths[0], widths[widths.len() - 1]);
            }
            StrategySettings::Neat(_) => {
                return Err(ArenaError::Settings(
                    "evolution.strategy: neat evolves controllers of the kind graph".into(),
                ));
            }
            other if grows => {
                let name = other.name();
                return Err(ArenaError::Settings(format!(
                    "controller.kind: graph is evolved by neat, not by {name}"
                )));
            }
            // Angles want all of their range, −1 to 1, from the start; weights add up and saturate.
            StrategySettings::Es(es) if natural && es.sigma == 0.0 => {
                let network = controller.kind.is_some_and(Kind::has_network);
                es.sigma = if network { 0.3 } else { 0.7 };
            }
            _ => {}
        }
        let task = TaskSettings {
            name: found.name().into(),
            steps: Some(steps),
            grow: Some(grow),
            end_on_fall: Some(self.task.end_on_fall.unwrap_or(natural && found.falls())),
            weights: Some(weights),
        };
        let controller = controller.resolved(body);
        let evolution = Some(evolution);
        Ok((found, Self { task, search, controller, evolution, world, ..self.clone() }))
    }
}
