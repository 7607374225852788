//! A search in small portions: for a game that goes on meanwhile.

use std::time::{Duration, Instant};

use crate::arena::WAYS;
use crate::episode::Plan;
use crate::evolution::Finalists;
use crate::meter::Tally;
use crate::trials::{Flight, Trial};
use crate::{Arena, ArenaError, Champion, Evolution, Told, Until};

/// Steps between two looks at the clock: a fraction of a millisecond.
const PORTION: u32 = 32;

/// A search that is given some time whenever there is some: the same generations and the same
/// champion as [`Evolution::step`] brings, whatever the portions.
pub struct Learner {
    arena: Arena,
    evolution: Evolution,
    work: Option<Work>,
}

/// What is being tried.
struct Work {
    chore: Chore,
    /// Individuals to be tried, how they are told apart by the chore, and what came of them.
    genomes: Vec<Vec<f32>>,
    /// How many trials they come to.
    trials: usize,
    found: Vec<Option<Tally>>,
    flight: Option<Flight>,
}

enum Chore {
    /// A generation's fitness.
    Generation,
    /// Replays of its best.
    Replays(Told),
    /// The best of those under other physics.
    Variations(Told, Finalists),
}

impl Learner {
    /// A search at its start.
    ///
    /// # Errors
    /// None after [`Arena::new`].
    pub fn new(arena: Arena) -> Result<Self, ArenaError> {
        let evolution = Evolution::new(&arena)?;
        Ok(Self { arena, evolution, work: None })
    }

    /// Where it learns.
    pub fn arena(&self) -> &Arena {
        &self.arena
    }

    /// The search.
    pub fn evolution(&self) -> &Evolution {
        &self.evolution
    }

    /// The best that was found so far.
    pub fn champion(&self) -> Option<&Champion> {
        self.evolution.champion()
    }

    /// Whether the champion is as it shall be.
    pub fn has(&self, until: Until) -> bool {
        self.champion().is_some_and(|champion| champion.is(until))
    }

    /// Works for about so long, on this thread, and says how the generation did if one came to its
    /// end. A budget of 0 does one portion. It takes longer than asked for by one portion, by the
    /// making of a generation's worlds (a millisecond), and when there is a new champion by its
    /// judgement (about ten); in Box2D, which cannot be stopped in between, by a whole batch.
    ///
    /// # Errors
    /// A refusal of the physics engine.
    pub fn work(&mut self, budget: Duration) -> Result<Option<Told>, ArenaError> {
        let began = Instant::now();
        loop {
            if let Some(told) = self.portion()? {
                return Ok(Some(told));
            }
            if began.elapsed() >= budget {
                return Ok(None);
            }
        }
    }

    /// One portion; how the generation did if that was its last.
    fn portion(&mut self) -> Result<Option<Told>, ArenaError> {
        let mut work = match self.work.take() {
            Some(work) => work,
            None => Work::new(Chore::Generation, self.evolution.ask().to_vec()),
        };
        if !self.advance(&mut work)? {
            self.work = Some(work);
            return Ok(None);
        }
        let Work { chore, genomes, found, .. } = work;
        match chore {
            Chore::Generation => {
                let (_, wanted) = self.arena.fitness_plan(self.evolution.steps(&self.arena));
                let scores = found.into_iter().map(|tally| self.arena.score_of(tally, &wanted));
                let scores: Vec<_> = scores.collect();
                let (told, hopefuls) = self.evolution.take(&self.arena, &scores)?;
                if hopefuls.is_empty() {
                    return Ok(Some(told));
                }
                self.work = Some(Work::new(Chore::Replays(told), hopefuls));
                Ok(None)
            }
            Chore::Replays(told) => {
                let finalists = self.evolution.finalists(&self.arena, &genomes, &found);
                let genomes = finalists.genomes();
                self.work = Some(Work::new(Chore::Variations(told, finalists), genomes));
                Ok(None)
            }
            Chore::Variations(mut told, finalists) => {
                told.crowned = self.evolution.crown(&self.arena, &finalists, &found)?;
                Ok(Some(told))
            }
        }
    }

    /// Some steps of the batch at hand; whether all batches are done.
    fn advance(&self, work: &mut Work) -> Result<bool, ArenaError> {
        let done = work.found.len();
        if done >= work.trials {
            return Ok(true);
        }
        let mut flight = match work.flight.take() {
            Some(flight) => flight,
            None => {
                let (trials, plan) = self.trials(work);
                let batch = done..(done + self.arena.width().lanes()).min(trials.len());
                Flight::new(&trials[batch], self.arena.bench(plan, 1))?
            }
        };
        match flight.advance(PORTION)? {
            Some(found) => work.found.extend(found),
            None => work.flight = Some(flight),
        }
        Ok(work.found.len() >= work.trials)
    }

    fn trials<'a>(&'a self, work: &'a Work) -> (Vec<Trial<'a>>, Plan) {
        match work.chore {
            Chore::Generation => {
                let (plan, _) = self.arena.fitness_plan(self.evolution.steps(&self.arena));
                (self.arena.trials(&work.genomes), plan)
            }
            Chore::Replays(_) => (self.arena.trials(&work.genomes), Plan::JUDGED),
            Chore::Variations(..) => (self.arena.varied(&work.genomes), Plan::JUDGED),
        }
    }
}

impl Work {
    fn new(chore: Chore, genomes: Vec<Vec<f32>>) -> Self {
        let ways = if matches!(chore, Chore::Variations(..)) { WAYS } else { 1 };
        let trials = ways * genomes.len();
        Self { chore, genomes, trials, found: Vec::new(), flight: None }
    }
}
