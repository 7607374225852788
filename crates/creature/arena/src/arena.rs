//! Fitness of genomes, on all cores.

use ambulo_body::Body;
use ambulo_evolve::{EvolveError, StrategySettings};
use ambulo_lanes::Width;
use ambulo_pilot::{Pilot, PilotError};
use ambulo_world::{Physics, World, WorldError};

use crate::episode::Plan;
use crate::judge::judge;
use crate::meter::Tally;
use crate::record::{Rollout, record};
use crate::terms::{Term, Terms, mean};
use crate::trials::{Bench, Trial, tried};
use crate::{Judgement, Settings, Task};

/// Motor reversals of a joint that count as the quickest kind of motion, a second.
const QUICKEST: f64 = 8.0;
/// Replays with pushes, and how many of them a robust motion gets through.
const PUSHED: u64 = 16;
const PUSHED_WELL: usize = 15;
/// Replays of a genome under all physics that a robust motion gets through.
pub(crate) const WAYS: usize = 5 + PUSHED as usize;
/// Seed of the pushes of tasks that push.
pub(crate) const FIRST_PUSHES: u64 = 1000;

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
    /// Share of the episode before a fall ended it.
    pub alive: f64,
    /// What kind of motion it is, each number 0 to 1: the feet's time on the ground (without legs the
    /// torso's), and how quickly motors are told to reverse.
    pub behaviour: [f64; 2],
    /// The measured terms.
    pub terms: Terms,
}

/// How a motion holds up under other physics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Robustness {
    /// Usable as it is.
    pub usable: bool,
    /// Usable with friction times 0.75 and 1.25.
    pub friction: [bool; 2],
    /// Usable with mass times 0.9 and 1.1.
    pub mass: [bool; 2],
    /// Usable replays of 16 with pushes: every 2 s the torso gets ± what would change the speed of
    /// the whole creature by 0.3 m/s.
    pub pushes: usize,
}

impl Robustness {
    /// Usable in all, but for one replay with pushes.
    pub fn is_robust(&self) -> bool {
        let calm = [self.usable, self.friction[0], self.friction[1], self.mass[0], self.mass[1]];
        calm.iter().all(|&usable| usable) && self.pushes >= PUSHED_WELL
    }

    /// How many of the 20 variations are usable.
    pub fn held(&self) -> usize {
        let calm = self.friction.iter().chain(&self.mass);
        calm.filter(|&&usable| usable).count() + self.pushes
    }
}

/// A body, a kind of controller, a world and a task.
pub struct Arena {
    body: Body,
    settings: Settings,
    task: &'static dyn Task,
    genes: usize,
    width: Width,
}

impl Arena {
    /// Checks everything, so that nothing fails later.
    ///
    /// # Errors
    /// Settings out of range, with the name of the field; a creature with nothing to drive.
    pub fn new(body: Body, settings: Settings) -> Result<Self, ArenaError> {
        let (task, settings) = settings.resolved(&body)?;
        settings.world.check().map_err(WorldError::from)?;
        let genes = Pilot::genes(&body, &settings.controller)?;
        // The engine has the last word on shapes.
        World::new(&body, &settings.world, 1)?;
        let arena = Self { body, settings, task, genes, width: Width::widest() };
        arena.strategy().check()?;
        Ok(arena)
    }

    /// The same with so many lanes, for who wants to measure or compare them; the results are the
    /// same to the last bit.
    ///
    /// # Panics
    /// This machine has not so many.
    pub fn with_width(self, width: Width) -> Self {
        assert!(width.is_available(), "this machine has not so many lanes");
        Self { width, ..self }
    }

    /// How many lanes it uses.
    pub fn width(&self) -> Width {
        self.width
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

    /// How many numbers a genome has; of networks that grow, the least.
    pub fn genes(&self) -> usize {
        self.genes
    }

    /// The strategy.
    pub fn strategy(&self) -> &StrategySettings {
        self.settings.evolution.as_ref().expect("resolved")
    }

    /// The controller that a genome means.
    ///
    /// # Errors
    /// A genome of another length, or not finite.
    pub fn pilot(&self, genome: &[f32]) -> Result<Pilot, ArenaError> {
        Ok(Pilot::new(&self.body, &self.settings.controller, genome)?)
    }

    /// The fitness of each genome in episodes of so many steps, on so many threads. Depends on the
    /// genome alone.
    ///
    /// # Errors
    /// A genome of another length; a refusal of the physics engine.
    pub fn evaluate(
        &self,
        genomes: &[Vec<f32>],
        steps: u32,
        threads: usize,
    ) -> Result<Vec<Score>, ArenaError> {
        let (_, wanted) = self.fitness_plan(steps);
        self.scores(genomes, steps, threads, &wanted)
    }

    /// One genome in an episode of full length, with all terms measured, whether they count or not.
    ///
    /// # Errors
    /// As [`Arena::evaluate`].
    pub fn score(&self, genome: &[f32]) -> Result<Score, ArenaError> {
        let mut scores = self.scores(&[genome.to_vec()], self.steps(), 1, &Term::ALL)?;
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

    /// How each genome's motion holds up under other physics, replayed for 2000 steps.
    ///
    /// # Errors
    /// As [`Arena::evaluate`].
    pub fn robustness(
        &self,
        genomes: &[Vec<f32>],
        threads: usize,
    ) -> Result<Vec<Robustness>, ArenaError> {
        let tallies = tried(&self.varied(genomes), self.bench(Plan::JUDGED, threads))?;
        Ok(self.robustness_of(&tallies))
    }

    /// Every genome under all physics that a robust motion gets through.
    pub(crate) fn varied<'a>(&'a self, genomes: &'a [Vec<f32>]) -> Vec<Trial<'a>> {
        let calm = self.settings.world;
        let scaled = |friction: f32, mass: f32| Physics {
            friction_scale: calm.friction_scale * friction,
            mass_scale: calm.mass_scale * mass,
            ..calm
        };
        let always = self.task.pushed().then_some(FIRST_PUSHES);
        let mut ways: Vec<(Physics, Option<u64>)> = vec![
            (calm, always),
            (scaled(0.75, 1.0), always),
            (scaled(1.25, 1.0), always),
            (scaled(1.0, 0.9), always),
            (scaled(1.0, 1.1), always),
        ];
        ways.extend((0..PUSHED).map(|seed| (calm, Some(seed))));
        let of = |genome: &'a Vec<f32>| {
            let body = &self.body;
            let trial = move |(physics, pushes)| Trial { body, genome, physics, pushes };
            ways.clone().into_iter().map(trial)
        };
        genomes.iter().flat_map(of).collect()
    }

    /// What trials of [`Arena::varied`] came to.
    pub(crate) fn robustness_of(&self, tallies: &[Option<Tally>]) -> Vec<Robustness> {
        let of = |tallies: &[Option<Tally>]| {
            let usable: Vec<_> = tallies.iter().map(|tally| self.natural(tally).1).collect();
            Robustness {
                usable: usable[0],
                friction: [usable[1], usable[2]],
                mass: [usable[3], usable[4]],
                pushes: usable[5..].iter().filter(|&&usable| usable).count(),
            }
        };
        tallies.chunks(WAYS).map(of).collect()
    }

    /// Natural fitness, and whether the motion is usable; NaN and no if it came to nothing that is a
    /// number.
    pub(crate) fn natural(&self, tally: &Option<Tally>) -> (f64, bool) {
        let gravity = f64::from(self.settings.world.gravity);
        tally.as_ref().map_or((f64::NAN, false), |tally| {
            let natural = self.task.natural(tally, &self.body, gravity);
            (natural, self.task.reasons(tally, &self.body).is_empty())
        })
    }

    fn weights(&self) -> &Terms {
        self.settings.task.weights.as_ref().expect("resolved")
    }

    /// Physics steps of an episode of full length.
    pub fn steps(&self) -> u32 {
        self.settings.task.steps.expect("resolved")
    }

    /// Physics steps of the episodes of each stage; the last is of full length.
    pub fn stages(&self) -> Vec<u32> {
        let grow = self.settings.task.grow.as_ref().expect("resolved");
        grow.iter().copied().chain([self.steps()]).collect()
    }

    pub(crate) fn bench(&self, plan: Plan, threads: usize) -> Bench<'_> {
        Bench { controller: &self.settings.controller, width: self.width, threads, plan }
    }

    /// Every genome as it is.
    pub(crate) fn trials<'a>(&'a self, genomes: &'a [Vec<f32>]) -> Vec<Trial<'a>> {
        let physics = self.settings.world;
        let pushes = self.task.pushed().then_some(FIRST_PUSHES);
        let trial = |genome: &'a Vec<f32>| Trial { body: &self.body, genome, physics, pushes };
        genomes.iter().map(trial).collect()
    }

    /// How episodes of so many steps go; `wanted`: the terms that are to be measured.
    fn plan(&self, steps: u32, wanted: &[Term]) -> Plan {
        Plan {
            steps,
            falls: self.settings.task.end_on_fall.expect("resolved"),
            torques: wanted.contains(&Term::Energy) || wanted.contains(&Term::Natural),
            series: wanted.contains(&Term::Symmetry),
        }
    }

    /// How episodes go in which fitness is measured, and the terms that count.
    pub(crate) fn fitness_plan(&self, steps: u32) -> (Plan, Vec<Term>) {
        let counts = |(term, weight): (&Term, &f64)| (*weight != 0.0).then_some(*term);
        let wanted: Vec<_> = self.weights().iter().filter_map(counts).collect();
        (self.plan(steps, &wanted), wanted)
    }

    fn scores(
        &self,
        genomes: &[Vec<f32>],
        steps: u32,
        threads: usize,
        wanted: &[Term],
    ) -> Result<Vec<Score>, ArenaError> {
        let plan = self.plan(steps, wanted);
        let tallies = tried(&self.trials(genomes), self.bench(plan, threads))?;
        Ok(tallies.into_iter().map(|tally| self.score_of(tally, wanted)).collect())
    }

    pub(crate) fn score_of(&self, tally: Option<Tally>, wanted: &[Term]) -> Score {
        let Some(tally) = tally else {
            let (fitness, terms) = (f64::NAN, Terms::new());
            return Score { fitness, alive: 0.0, behaviour: [0.0; 2], terms };
        };
        let gravity = f64::from(self.settings.world.gravity);
        let value = |term: &Term| (*term, term.of(&tally, &self.body, gravity, self.task));
        let terms: Terms = wanted.iter().map(value).collect();
        let weighted = self.weights().iter().filter(|(_, weight)| **weight != 0.0);
        let down = if tally.duty.is_empty() { tally.torso_contact } else { mean(&tally.duty) };
        let told = tally.lived.max(1.0) * tally.dt * tally.deviation.len().max(1) as f64;
        Score {
            fitness: weighted.map(|(term, weight)| weight * terms[term]).sum(),
            alive: tally.alive(),
            behaviour: [down, (tally.reversals / told / QUICKEST).min(1.0)],
            terms,
        }
    }
}
