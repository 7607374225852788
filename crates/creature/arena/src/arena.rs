//! Fitness of genomes, on all cores.

use std::sync::Arc;

use ambulo_body::{Body, BodyError};
use ambulo_evolve::{EvolveError, Random, StrategySettings};
use ambulo_lanes::Width;
use ambulo_pilot::{Pilot, PilotError};
use ambulo_world::{Physics, World, WorldError};

use crate::episode::Plan;
use crate::judge::judge;
use crate::meter::Tally;
use crate::record::{Rollout, record};
use crate::terms::{Term, Terms, mean};
use crate::trials::{Bench, Individual, Trial, tried};
use crate::{Judgement, Lesson, Round, Settings, Task};

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
    #[error("curriculum[{index}]: {source}")]
    Lesson { index: usize, source: Box<ArenaError> },
    #[error("a genome's numbers for the body: {expected} that are finite are expected")]
    Genome { expected: usize },
    #[error("the body that a genome means: {0}")]
    Body(#[from] BodyError),
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
    /// Whether nothing in the episode, short as it may be, speaks against its being usable.
    pub promising: bool,
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
    body: Arc<Body>,
    settings: Settings,
    task: &'static dyn Task,
    /// Of its lessons, in their order.
    lessons: Vec<Arena>,
    /// Numbers of a genome that are the controller's, and that are the body's.
    genes: [usize; 2],
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
        let evolving = settings.body.as_ref().map_or(0, |morphology| morphology.genes(&body));
        let genes = [Pilot::genes(&body, &settings.controller)?, evolving];
        // The engine has the last word on shapes.
        World::new(&body, &settings.world, 1)?;
        let lesson = |(index, lesson): (usize, &Lesson)| {
            let arena = Arena::new(body.clone(), lesson.settings(&settings));
            arena.map_err(|source| ArenaError::Lesson { index, source: Box::new(source) })
        };
        let lessons =
            settings.curriculum.iter().enumerate().map(lesson).collect::<Result<_, _>>()?;
        let body = Arc::new(body);
        let arena = Self { body, settings, task, lessons, genes, width: Width::widest() };
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
        let lessons = self.lessons.into_iter().map(|lesson| lesson.with_width(width)).collect();
        Self { width, lessons, ..self }
    }

    /// How many lanes it uses.
    pub fn width(&self) -> Width {
        self.width
    }

    /// The creature, as its file has it.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// How many lessons come before the task.
    pub fn lessons(&self) -> usize {
        self.lessons.len()
    }

    /// Where it is learned when so many lessons are ahead of the task.
    ///
    /// # Panics
    /// There are not so many.
    pub fn ahead(&self, lessons: usize) -> &Arena {
        if lessons == 0 { self } else { &self.lessons[self.lessons.len() - lessons] }
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
        self.genes.iter().sum()
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
        let individual = self.individual(genome)?;
        Ok(Pilot::new(&individual.body, &self.settings.controller, individual.genes())?)
    }

    /// The body that a genome means: the creature, or where bodies evolve one with other measures.
    ///
    /// # Errors
    /// As [`Arena::pilot`].
    pub fn body_of(&self, genome: &[f32]) -> Result<Arc<Body>, ArenaError> {
        Ok(self.individual(genome)?.body)
    }

    /// A genome with its body.
    pub(crate) fn individual(&self, genome: &[f32]) -> Result<Individual, ArenaError> {
        let expected = self.genes[1];
        let steering = genome.len().saturating_sub(expected);
        let genes = &genome[steering..];
        if genes.len() != expected || genes.iter().any(|gene| !gene.is_finite()) {
            return Err(ArenaError::Genome { expected });
        }
        let body = match &self.settings.body {
            Some(morphology) => Arc::new(morphology.apply(&self.body, genes)?),
            None => self.body.clone(),
        };
        Ok(Individual { genome: genome.to_vec(), steering, body })
    }

    pub(crate) fn individuals(&self, genomes: &[Vec<f32>]) -> Result<Vec<Individual>, ArenaError> {
        genomes.iter().map(|genome| self.individual(genome)).collect()
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
        self.try_round(genomes, Round { ahead: 0, steps, draw: None }, threads)
    }

    /// The fitness of each genome in a round of a search, on so many threads. Depends on genome and
    /// round alone.
    ///
    /// # Errors
    /// As [`Arena::evaluate`]; a round of more lessons than there are.
    pub fn try_round(
        &self,
        genomes: &[Vec<f32>],
        round: Round,
        threads: usize,
    ) -> Result<Vec<Score>, ArenaError> {
        if round.ahead > self.lessons.len() {
            let (ahead, lessons) = (round.ahead, self.lessons.len());
            return Err(ArenaError::Settings(format!("{ahead} lessons ahead, of {lessons}")));
        }
        let arena = self.ahead(round.ahead);
        let individuals = arena.individuals(genomes)?;
        let trials = arena.of_round(&individuals, round);
        let tallies = tried(&trials, arena.bench(arena.round_plan(round), threads))?;
        Ok(arena.round_scores(&individuals, &tallies))
    }

    /// One genome in an episode of full length, with all terms measured, whether they count or not.
    ///
    /// # Errors
    /// As [`Arena::evaluate`].
    pub fn score(&self, genome: &[f32]) -> Result<Score, ArenaError> {
        let individual = self.individual(genome)?;
        let individuals = std::slice::from_ref(&individual);
        let plan = self.plan(self.steps(), &Term::ALL);
        let tally = tried(&self.trials(individuals), self.bench(plan, 1))?.remove(0);
        Ok(self.score_of(&individual.body, tally.as_ref(), &Term::ALL))
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
        let individuals = self.individuals(genomes)?;
        let tallies = tried(&self.varied(&individuals), self.bench(Plan::JUDGED, threads))?;
        Ok(self.robustness_of(&individuals, &tallies))
    }

    /// Every individual under all physics that a robust motion gets through.
    pub(crate) fn varied<'a>(&self, individuals: &'a [Individual]) -> Vec<Trial<'a>> {
        let calm = self.settings.world;
        let scaled = |friction: f32, mass: f32| calm.scaled(friction, mass, 1.0, 1.0);
        let always = self.task.pushed().then_some(FIRST_PUSHES);
        let mut ways: Vec<(Physics, Option<u64>)> = vec![
            (calm, always),
            (scaled(0.75, 1.0), always),
            (scaled(1.25, 1.0), always),
            (scaled(1.0, 0.9), always),
            (scaled(1.0, 1.1), always),
        ];
        ways.extend((0..PUSHED).map(|seed| (calm, Some(seed))));
        let of = |individual: &'a Individual| {
            let trial = move |(physics, pushes)| Trial { individual, physics, pushes };
            ways.clone().into_iter().map(trial)
        };
        individuals.iter().flat_map(of).collect()
    }

    /// What trials of [`Arena::varied`] came to.
    pub(crate) fn robustness_of(
        &self,
        individuals: &[Individual],
        tallies: &[Option<Tally>],
    ) -> Vec<Robustness> {
        let of = |(individual, tallies): (&Individual, &[Option<Tally>])| {
            let usable: Vec<_> =
                tallies.iter().map(|tally| self.natural(&individual.body, tally).1).collect();
            Robustness {
                usable: usable[0],
                friction: [usable[1], usable[2]],
                mass: [usable[3], usable[4]],
                pushes: usable[5..].iter().filter(|&&usable| usable).count(),
            }
        };
        individuals.iter().zip(tallies.chunks(WAYS)).map(of).collect()
    }

    /// Natural fitness, and whether the motion is usable; NaN and no if it came to nothing that is a
    /// number.
    pub(crate) fn natural(&self, body: &Body, tally: &Option<Tally>) -> (f64, bool) {
        let gravity = f64::from(self.settings.world.gravity);
        tally.as_ref().map_or((f64::NAN, false), |tally| {
            let natural = self.task.natural(tally, body, gravity);
            (natural, self.task.reasons(tally, body).is_empty())
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

    /// Every individual as it is.
    pub(crate) fn trials<'a>(&self, individuals: &'a [Individual]) -> Vec<Trial<'a>> {
        let physics = self.settings.world;
        let pushes = self.task.pushed().then_some(FIRST_PUSHES);
        let trial = |individual: &'a Individual| Trial { individual, physics, pushes };
        individuals.iter().map(trial).collect()
    }

    /// Every individual of a round: as it is, then, if that is asked for, under other physics, which
    /// are the same for all.
    pub(crate) fn of_round<'a>(
        &self,
        individuals: &'a [Individual],
        round: Round,
    ) -> Vec<Trial<'a>> {
        let mut trials = self.trials(individuals);
        if let Some(seed) = round.draw {
            let (physics, pushes) = (drawn(self.settings.world, seed), Some(seed));
            trials.extend(individuals.iter().map(|individual| Trial {
                individual,
                physics,
                pushes,
            }));
        }
        trials
    }

    /// What trials of [`Arena::of_round`] came to: of each individual the worse one.
    pub(crate) fn round_scores(
        &self,
        individuals: &[Individual],
        tallies: &[Option<Tally>],
    ) -> Vec<Score> {
        let wanted = self.wanted();
        let score = |index: usize| {
            let tries = tallies.iter().skip(index).step_by(individuals.len());
            let body = &individuals[index].body;
            let scores = tries.map(|tally| self.score_of(body, tally.as_ref(), &wanted));
            let worse = |a: Score, b: Score| {
                // What is not a number is the worst.
                if a.fitness.is_nan() || a.fitness <= b.fitness { a } else { b }
            };
            scores.reduce(worse).expect("each is tried")
        };
        (0..individuals.len()).map(score).collect()
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

    /// The terms that count.
    fn wanted(&self) -> Vec<Term> {
        let counts = |(term, weight): (&Term, &f64)| (*weight != 0.0).then_some(*term);
        self.weights().iter().filter_map(counts).collect()
    }

    /// How episodes of a round go.
    pub(crate) fn round_plan(&self, round: Round) -> Plan {
        self.plan(round.steps, &self.wanted())
    }

    fn score_of(&self, body: &Body, tally: Option<&Tally>, wanted: &[Term]) -> Score {
        let Some(tally) = tally else {
            let (fitness, terms) = (f64::NAN, Terms::new());
            let behaviour = [0.0; 2];
            return Score { fitness, alive: 0.0, behaviour, promising: false, terms };
        };
        let gravity = f64::from(self.settings.world.gravity);
        let value = |term: &Term| (*term, term.of(tally, body, gravity, self.task));
        let terms: Terms = wanted.iter().map(value).collect();
        let weighted = self.weights().iter().filter(|(_, weight)| **weight != 0.0);
        let down = if tally.duty.is_empty() { tally.torso_contact } else { mean(&tally.duty) };
        let told = tally.lived.max(1.0) * tally.dt * tally.deviation.len().max(1) as f64;
        Score {
            fitness: weighted.map(|(term, weight)| weight * terms[term]).sum(),
            alive: tally.alive(),
            behaviour: [down, (tally.reversals / told / QUICKEST).min(1.0)],
            promising: self.task.promising(tally, body),
            terms,
        }
    }
}

/// Other physics than those, to be drawn in training.
fn drawn(calm: Physics, seed: u64) -> Physics {
    let mut random = Random::new(seed);
    let mut about_one = |most: f32| 1.0 + random.around(most);
    calm.scaled(about_one(0.25), about_one(0.1), about_one(0.1), about_one(0.1))
}
