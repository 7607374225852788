//! Fitness of genomes, on all cores.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use ambulo_body::Body;
use ambulo_evolve::{EvolveError, Genetic};
use ambulo_pilot::{Pilot, PilotError};
use ambulo_world::{Ground, World, WorldError};

use crate::episode::{Walker, run};
use crate::judge::judge;
use crate::record::{Rollout, record};
use crate::terms::{Meter, Terms, Wanted};
use crate::{Judgement, Settings, Task};

/// The most individuals that share a world, and the most parts of all of them: a world costs time of
/// its own, but the engine looks through all parts that are near each other.
const MOST_TOGETHER: usize = 12;
const MOST_PARTS_TOGETHER: usize = 48;

/// Why an arena cannot be made, or a genome not be tried.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum ArenaError {
    #[error("{0}")]
    Settings(String),
    #[error(transparent)]
    Pilot(#[from] PilotError),
    #[error(transparent)]
    Evolve(#[from] EvolveError),
    #[error("world.{0}")]
    World(#[from] WorldError),
}

/// How a genome did.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// More is better; NaN if it came to nothing that is a number.
    pub fitness: f64,
    /// The measured terms.
    pub terms: Terms,
}

/// A body, a kind of controller, a world and a task.
pub struct Arena {
    body: Body,
    settings: Settings,
    task: &'static dyn Task,
    genes: usize,
}

impl Arena {
    /// Checks everything, so that nothing fails later.
    ///
    /// # Errors
    /// Settings out of range, with the name of the field; a creature with nothing to drive.
    pub fn new(body: Body, settings: Settings) -> Result<Self, ArenaError> {
        let (task, task_settings) = settings.task()?;
        settings.evolution.check()?;
        settings.world.check().map_err(WorldError::from)?;
        let genes = Pilot::genes(&body, &settings.controller)?;
        // The engine has the last word on shapes.
        World::new(&body, &settings.world, 1)?;
        let controller = settings.controller.resolved(&body);
        let settings = Settings { controller, task: task_settings, ..settings };
        Ok(Self { body, settings, task, genes })
    }

    /// The creature.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Its settings, with everything said.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Its task.
    pub fn task(&self) -> &'static dyn Task {
        self.task
    }

    /// How many numbers a genome has.
    pub fn genes(&self) -> usize {
        self.genes
    }

    /// The search at its start.
    ///
    /// # Errors
    /// None after [`Arena::new`].
    pub fn search(&self) -> Result<Genetic, ArenaError> {
        Ok(Genetic::new(self.settings.evolution.clone(), self.genes, self.settings.seed)?)
    }

    /// The controller that a genome means.
    ///
    /// # Errors
    /// A genome of another length, or not finite.
    pub fn pilot(&self, genome: &[f32]) -> Result<Pilot, ArenaError> {
        Ok(Pilot::new(&self.body, &self.settings.controller, genome)?)
    }

    /// The fitness of each genome, on so many threads. Depends on the genome alone.
    ///
    /// # Errors
    /// A genome of another length; a refusal of the physics engine.
    pub fn evaluate(&self, genomes: &[Vec<f32>], threads: usize) -> Result<Vec<Score>, ArenaError> {
        self.evaluate_wanted(genomes, threads, Wanted::weighted(self.weights()))
    }

    /// One genome, with all terms measured, whether they count or not.
    ///
    /// # Errors
    /// As [`Arena::evaluate`].
    pub fn score(&self, genome: &[f32]) -> Result<Score, ArenaError> {
        let mut scores = self.evaluate_wanted(&[genome.to_vec()], 1, Wanted::all())?;
        Ok(scores.remove(0))
    }

    /// Records a genome for so many steps from the start, whether it falls or not.
    ///
    /// # Errors
    /// As [`Arena::evaluate`].
    pub fn record(&self, genome: &[f32], steps: u32) -> Result<Rollout, ArenaError> {
        record(self, genome, steps)
    }

    /// Whether a recorded motion is usable, and its figures.
    pub fn judge(&self, rollout: &Rollout) -> Judgement {
        judge(self, rollout)
    }

    fn weights(&self) -> &Terms {
        self.settings.task.weights.as_ref().expect("resolved")
    }

    /// Physics steps of an episode.
    pub fn steps(&self) -> u32 {
        self.settings.task.steps.expect("resolved")
    }

    fn evaluate_wanted(
        &self,
        genomes: &[Vec<f32>],
        threads: usize,
        wanted: Wanted,
    ) -> Result<Vec<Score>, ArenaError> {
        let threads = threads.clamp(1, genomes.len().max(1));
        let lanes = match self.settings.world.ground {
            Ground::Flat => (MOST_PARTS_TOGETHER / self.body.parts().len()).clamp(1, MOST_TOGETHER),
            _ => 1,
        };
        // Batches of one size, as many for each thread.
        let count = threads * genomes.len().div_ceil(threads * lanes);
        let bounds = |batch: usize| batch * genomes.len() / count.max(1);
        let next = AtomicUsize::new(0);
        let scores: Mutex<Vec<Option<Score>>> = Mutex::new(vec![None; genomes.len()]);
        let work = || -> Result<(), ArenaError> {
            loop {
                let batch = next.fetch_add(1, Ordering::Relaxed);
                if batch >= count {
                    return Ok(());
                }
                let range = bounds(batch)..bounds(batch + 1);
                let found = self.batch(&genomes[range.clone()], wanted)?;
                let mut scores = scores.lock().expect("nothing panics with it");
                range.zip(found).for_each(|(index, score)| scores[index] = Some(score));
            }
        };
        std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            let mine = work();
            let theirs = others.into_iter().map(|thread| thread.join().expect("no panic"));
            theirs.fold(mine, Result::and)
        })?;
        let scores = scores.into_inner().expect("nothing panics with it");
        Ok(scores.into_iter().map(|score| score.expect("every batch was done")).collect())
    }

    /// Genomes that share a world.
    fn batch(&self, genomes: &[Vec<f32>], wanted: Wanted) -> Result<Vec<Score>, ArenaError> {
        if genomes.is_empty() {
            return Ok(vec![]);
        }
        match self.together(genomes, wanted) {
            // Whoever broke the world must not spoil it for the others.
            Err(ArenaError::World(WorldError::Engine(_))) if genomes.len() > 1 => {
                let alone = genomes
                    .iter()
                    .map(|genome| Ok(self.batch(std::slice::from_ref(genome), wanted)?.remove(0)));
                alone.collect()
            }
            Err(ArenaError::World(WorldError::Engine(_))) => {
                Ok(vec![Score { fitness: f64::NAN, terms: Terms::new() }])
            }
            other => other,
        }
    }

    fn together(&self, genomes: &[Vec<f32>], wanted: Wanted) -> Result<Vec<Score>, ArenaError> {
        let physics = &self.settings.world;
        let walker = |genome: &Vec<f32>| Ok(Walker::new(self.pilot(genome)?, &self.body));
        let mut walkers = genomes.iter().map(walker).collect::<Result<Vec<_>, ArenaError>>()?;
        let mut world = World::new(&self.body, physics, genomes.len())?;
        let meter = |individual| {
            Meter::new(&self.body, wanted, world.centre(individual, self.body.torso()))
        };
        let mut meters: Vec<_> = (0..genomes.len()).map(meter).collect();
        let falls = self.settings.task.end_on_fall;
        let (torso, legs) = (self.body.torso(), !self.body.legs().is_empty());
        run(
            &mut world,
            &self.body,
            &mut walkers,
            self.steps(),
            wanted.torques(),
            |_, _, _| {},
            |world, individual, moment| {
                meters[individual].watch(&moment);
                falls
                    && (moment.senses.torso_rotation.abs() > 1.0
                        || legs && world.touches(individual, torso))
            },
        )?;
        let scores = walkers.iter().zip(&meters).map(|(walker, meter)| {
            let terms = meter.terms(&self.body, world.dt(), physics.gravity);
            let weights = self.weights().iter();
            let sum =
                weights.filter(|(_, weight)| **weight != 0.0).map(|(t, w)| w * terms[t]).sum();
            Score { fitness: if walker.lost { f64::NAN } else { sum }, terms }
        });
        Ok(scores.collect())
    }
}
