//! A search from its first generation to its champion.

use ambulo_evolve::{Outcome, Search};
use serde::{Deserialize, Serialize};

use crate::episode::Plan;
use crate::meter::Tally;
use crate::settings::JUDGED;
use crate::trials::{Individual, tried};
use crate::{Arena, ArenaError, Robustness, Round, Score};

/// Of those whose replays are usable, the best so many are replayed under other physics.
const VARIED: usize = 2;

/// How much a motion is worth to who looks for a champion: first that it is usable, then under how
/// many physics, then that it is good; its natural fitness decides between equals.
const USABLE: f64 = 10.0;
const EACH_HELD: f64 = 1.0;
const ROBUST: f64 = 10.0;
const GOOD: f64 = 5.0;

/// Replays of motions that cannot be usable are made once in so many generations.
const SHOWN: u64 = 10;

/// By how much of itself a fitness must grow so that a search counts as getting on.
const LEAST_GAIN: f64 = 0.01;

/// When a search has found enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Until {
    /// A usable motion.
    Usable,
    /// One that is still usable under other physics.
    Robust,
    /// One that is robust and good.
    Good,
}

/// The best that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Champion {
    /// Its genome.
    pub genome: Vec<f32>,
    /// In an episode of full length.
    pub fitness: f64,
    /// When it was found, from 1.
    pub generation: u64,
    /// How it holds up, and whether it is good; nothing if champions are chosen by fitness.
    pub robustness: Option<Robustness>,
    /// See there.
    pub good: bool,
    /// What it was chosen by.
    merit: f64,
}

impl Champion {
    /// Whether it is enough.
    pub fn is(&self, until: Until) -> bool {
        let Some(robustness) = self.robustness else { return false };
        match until {
            Until::Usable => robustness.usable,
            Until::Robust => robustness.is_robust(),
            Until::Good => robustness.is_robust() && self.good,
        }
    }
}

/// How a generation did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Best and mean fitness of those that are numbers; NaN if none is.
    pub best: f64,
    /// See there.
    pub mean: f64,
    /// Steps of its episodes.
    pub steps: u32,
    /// How many lessons were ahead of the task itself.
    pub ahead: usize,
    /// Whether there is a new champion.
    pub crowned: bool,
    /// Whether a lesson is learned, and the next one begins.
    pub learned: bool,
    /// Whether the search began anew after it.
    pub restarted: bool,
}

/// A search with its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    strategy: Search,
    /// Generations that were told, those before a restart included.
    generation: u64,
    /// How many lessons are ahead of the task itself.
    ahead: usize,
    /// Which of the stages of that it is in.
    stage: usize,
    restarts: u64,
    /// Best fitness of the stage, and when it was reached.
    best: Option<f64>,
    best_at: u64,
    champion: Option<Champion>,
}

impl Evolution {
    /// A search at its start.
    ///
    /// # Errors
    /// None after [`Arena::new`].
    pub fn new(arena: &Arena) -> Result<Self, ArenaError> {
        let strategy = arena.strategy().start(arena.genes(), arena.settings().seed)?;
        Ok(Self {
            strategy,
            generation: 0,
            ahead: arena.lessons(),
            stage: 0,
            restarts: 0,
            best: None,
            best_at: 0,
            champion: None,
        })
    }

    /// Checks a state that was stored, for an arena.
    ///
    /// # Errors
    /// A state that is not of such a search.
    pub fn check(&self, arena: &Arena) -> Result<(), ArenaError> {
        self.strategy.check()?;
        let champion = self.champion.iter().map(|champion| &champion.genome);
        let fits = |genome: &Vec<f32>| arena.pilot(genome).is_ok();
        let known =
            self.ahead <= arena.lessons() && self.stage < arena.ahead(self.ahead).stages().len();
        if known && self.strategy.ask().iter().chain(champion).all(fits) {
            return Ok(());
        }
        Err(ArenaError::Settings("a stored search is not one of this creature and task".into()))
    }

    /// How many generations were told.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// How often it began anew.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// The strategy.
    pub fn strategy(&self) -> &Search {
        &self.strategy
    }

    /// The best that was found.
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }

    /// Different motions to choose from, best fitness of each kind: its place among kinds, fitness and
    /// genome. Only MAP-Elites keeps them.
    pub fn archive(&self) -> Vec<(&[usize], f64, &[f32])> {
        match &self.strategy {
            Search::MapElites(search) => search.archive().collect(),
            _ => vec![],
        }
    }

    /// The genomes whose fitness it wants to know.
    pub fn ask(&self) -> &[Vec<f32>] {
        self.strategy.ask()
    }

    /// How they are tried.
    pub fn round(&self, arena: &Arena) -> Round {
        let settings = arena.settings();
        let draw = settings.seed ^ self.generation.wrapping_mul(0xD1B5_4A32_D192_ED03);
        Round {
            ahead: self.ahead,
            steps: arena.ahead(self.ahead).stages()[self.stage],
            draw: settings.search.randomise.expect("resolved").then_some(draw),
        }
    }

    /// How many lessons are ahead of the task itself.
    pub fn ahead(&self) -> usize {
        self.ahead
    }

    /// Whether the champion is as it shall be.
    pub fn has(&self, until: Until) -> bool {
        self.champion().is_some_and(|champion| champion.is(until))
    }

    /// One generation: tries it, takes what it did, looks for a champion.
    ///
    /// # Errors
    /// A refusal of the physics engine.
    pub fn step(&mut self, arena: &Arena, threads: usize) -> Result<Told, ArenaError> {
        let scores = arena.try_round(self.ask(), self.round(arena), threads)?;
        self.tell(arena, &scores, threads)
    }

    /// Takes a score for each genome that it asked for, and makes the next generation.
    ///
    /// # Errors
    /// Another number of them than genomes; a refusal of the physics engine.
    pub fn tell(
        &mut self,
        arena: &Arena,
        scores: &[Score],
        threads: usize,
    ) -> Result<Told, ArenaError> {
        let (mut told, hopefuls) = self.take(arena, scores)?;
        if !hopefuls.is_empty() {
            let lesson = arena.ahead(told.ahead);
            let replays = tried(&lesson.trials(&hopefuls), lesson.bench(Plan::JUDGED, threads))?;
            let finalists = self.finalists(arena, told, hopefuls, &replays);
            let variations = lesson.varied(&finalists.usable);
            let varied = tried(&variations, lesson.bench(Plan::JUDGED, threads))?;
            self.crown(arena, &finalists, &varied, &mut told)?;
        }
        Ok(told)
    }

    /// Takes the scores and makes the next generation; whose replays are to be judged next.
    pub(crate) fn take(
        &mut self,
        arena: &Arena,
        scores: &[Score],
    ) -> Result<(Told, Vec<Individual>), ArenaError> {
        let lesson = arena.ahead(self.ahead);
        let asked = self.ask().to_vec();
        let outcome =
            |score: &Score| Outcome { fitness: score.fitness, behaviour: score.behaviour.to_vec() };
        let Round { ahead, steps, .. } = self.round(arena);
        self.strategy.tell(&scores.iter().map(outcome).collect::<Vec<_>>())?;
        self.generation += 1;
        let mut order: Vec<_> = (0..scores.len()).collect();
        order.retain(|&index| scores[index].fitness.is_finite());
        order.sort_by(|&a, &b| scores[b].fitness.total_cmp(&scores[a].fitness).then(a.cmp(&b)));
        let best = order.first().map_or(f64::NAN, |&index| scores[index].fitness);
        let sum: f64 = order.iter().map(|&index| scores[index].fitness).sum();
        let better = |before: f64| best > before + LEAST_GAIN * before.abs();
        if !order.is_empty() && self.best.is_none_or(better) {
            (self.best, self.best_at) = (Some(best), self.generation);
        }
        let many = arena.settings().search.trials.expect("resolved");
        // Now and then, whoever is best, so that there is something to show.
        let nothing = ahead == 0 && self.champion.is_none();
        let shown = nothing || self.generation % SHOWN == 1;
        let worth = order.iter().filter(|&&index| shown || scores[index].promising);
        let first = worth.take(many).map(|&index| lesson.individual(&asked[index]));
        let hopefuls = first.collect::<Result<Vec<_>, _>>()?;
        let crowned = many == 0
            && self.crown_the_fittest(arena, order.first().map(|&index| &asked[index]), best)?;
        if order.first().is_some_and(|&index| scores[index].alive >= 1.0 && scores[index].promising)
            && self.stage + 1 < lesson.stages().len()
        {
            self.stage += 1;
            (self.best, self.best_at) = (None, self.generation);
        }
        let patience = arena.settings().search.patience.expect("resolved");
        // An archive is what MAP-Elites is for: it is not thrown away.
        let keeps = matches!(self.strategy, Search::MapElites(_));
        let restarted = !keeps && patience > 0 && self.generation - self.best_at >= patience;
        if restarted {
            self.restarts += 1;
            let seed = arena.settings().seed ^ self.restarts.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            self.strategy = arena.strategy().start(arena.genes(), seed)?;
            self.ahead = arena.lessons();
            (self.stage, self.best, self.best_at) = (0, None, self.generation);
        }
        let mean = if order.is_empty() { f64::NAN } else { sum / order.len() as f64 };
        Ok((Told { best, mean, steps, ahead, crowned, learned: false, restarted }, hopefuls))
    }

    /// The seed's way: whoever has the most fitness.
    fn crown_the_fittest(
        &mut self,
        arena: &Arena,
        best: Option<&Vec<f32>>,
        reached: f64,
    ) -> Result<bool, ArenaError> {
        let Some(genome) = best else { return Ok(false) };
        let better =
            |fitness: f64| self.champion.as_ref().is_none_or(|champion| fitness > champion.fitness);
        // Shorter episodes are no measure.
        let whole = self.round(arena) == Round { ahead: 0, steps: arena.steps(), draw: None };
        if whole && !better(reached) {
            return Ok(false);
        }
        let fitness = arena.score(genome)?.fitness;
        if !better(fitness) {
            return Ok(false);
        }
        self.champion = Some(Champion {
            genome: genome.clone(),
            fitness,
            generation: self.generation,
            robustness: None,
            good: false,
            merit: fitness,
        });
        Ok(true)
    }

    /// Of those that were replayed, who is to be tried under other physics.
    pub(crate) fn finalists(
        &self,
        arena: &Arena,
        told: Told,
        hopefuls: Vec<Individual>,
        replays: &[Option<Tally>],
    ) -> Finalists {
        let natural = |(who, tally): (Individual, &Option<Tally>)| {
            let (natural, usable) = arena.ahead(told.ahead).natural(&who.body, tally);
            Finalist { natural, usable, who }
        };
        let found = hopefuls.into_iter().zip(replays).map(natural);
        let mut order: Vec<_> = found.filter(|finalist| finalist.natural.is_finite()).collect();
        // Usable first.
        order.sort_by(|a, b| {
            let key = |finalist: &Finalist| (finalist.usable, finalist.natural);
            key(b).partial_cmp(&key(a)).expect("finite")
        });
        let before = self.merit(told);
        let most = USABLE + 20.0 * EACH_HELD + ROBUST + GOOD;
        let best = order.first().map(|best| (best.natural, best.who.genome.clone()));
        let hopeful = |finalist: &Finalist| finalist.usable && most + finalist.natural > before;
        let usable = order.into_iter().filter(hopeful).take(VARIED);
        let (natural, usable) = usable.map(|finalist| (finalist.natural, finalist.who)).unzip();
        Finalists { best, natural, usable }
    }

    /// What a champion must be better than; in a lesson, which has none, than nothing.
    fn merit(&self, told: Told) -> f64 {
        let champion = self.champion.as_ref().filter(|_| told.ahead == 0);
        champion.map_or(f64::NEG_INFINITY, |champion| champion.merit)
    }

    /// Whoever holds up best is the champion, if better than that; or, in a lesson, ends it.
    pub(crate) fn crown(
        &mut self,
        arena: &Arena,
        finalists: &Finalists,
        varied: &[Option<Tally>],
        told: &mut Told,
    ) -> Result<(), ArenaError> {
        let Some((natural, genome)) = &finalists.best else { return Ok(()) };
        let mut best = (*natural, genome, Robustness::default());
        let lesson = arena.ahead(told.ahead);
        let held = lesson.robustness_of(&finalists.usable, varied);
        for ((natural, who), held) in finalists.natural.iter().zip(&finalists.usable).zip(held) {
            let robust = if held.is_robust() { ROBUST } else { 0.0 };
            let merit = USABLE + EACH_HELD * held.held() as f64 + robust + natural;
            if merit > best.0 {
                best = (merit, &who.genome, held);
            }
        }
        let (mut merit, genome, robustness) = best;
        let mut good = false;
        if robustness.usable && merit + GOOD > self.merit(*told) {
            good = lesson.judge(&lesson.record(genome, JUDGED)?).good;
            merit += if good { GOOD } else { 0.0 };
        }
        if merit <= self.merit(*told) {
            return Ok(());
        }
        let champion = Champion {
            genome: genome.clone(),
            fitness: lesson.score(genome)?.fitness,
            generation: self.generation,
            robustness: Some(robustness),
            good,
            merit,
        };
        if told.ahead == 0 {
            (self.champion, told.crowned) = (Some(champion), true);
        } else {
            let until = arena.settings().curriculum[arena.lessons() - told.ahead].until;
            // A search that began anew is at the first lesson again.
            told.learned = champion.is(until) && !told.restarted;
            if told.learned {
                self.ahead -= 1;
                (self.stage, self.best, self.best_at) = (0, None, self.generation);
            }
        }
        Ok(())
    }
}

/// Who was replayed, and how it did.
struct Finalist {
    natural: f64,
    usable: bool,
    who: Individual,
}

/// Those whose replays were best.
pub(crate) struct Finalists {
    /// Natural fitness and genome of the best one, usable or not.
    best: Option<(f64, Vec<f32>)>,
    /// Natural fitness of those who may be better than the champion, and they.
    natural: Vec<f64>,
    pub usable: Vec<Individual>,
}
