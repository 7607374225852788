//! A search in small portions: for a game that goes on meanwhile.

use std::time::{Duration, Instant};

use crate::episode::Plan;
use crate::evolution::Finalists;
use crate::meter::Tally;
use crate::trials::{Flight, Individual, Trial};
use crate::{Arena, ArenaError, Champion, Evolution, Round, Told, Until};

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
    individuals: Vec<Individual>,
    /// How many trials they come to.
    trials: usize,
    found: Vec<Option<Tally>>,
    flight: Option<Flight>,
}

enum Chore {
    /// A generation's fitness.
    Generation(Round),
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
        self.evolution.has(until)
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
            None => {
                let round = self.evolution.round(&self.arena);
                let lesson = self.arena.ahead(round.ahead);
                self.begin(Chore::Generation(round), lesson.individuals(self.evolution.ask())?)
            }
        };
        if !self.advance(&mut work)? {
            self.work = Some(work);
            return Ok(None);
        }
        let Work { chore, individuals, found, .. } = work;
        match chore {
            Chore::Generation(round) => {
                let scores = self.arena.ahead(round.ahead).round_scores(&individuals, &found);
                let (told, hopefuls) = self.evolution.take(&self.arena, &scores)?;
                if hopefuls.is_empty() {
                    return Ok(Some(told));
                }
                self.work = Some(self.begin(Chore::Replays(told), hopefuls));
                Ok(None)
            }
            Chore::Replays(told) => {
                let mut finalists =
                    self.evolution.finalists(&self.arena, told, individuals, &found);
                let usable = std::mem::take(&mut finalists.usable);
                self.work = Some(self.begin(Chore::Variations(told, finalists), usable));
                Ok(None)
            }
            Chore::Variations(mut told, mut finalists) => {
                finalists.usable = individuals;
                self.evolution.crown(&self.arena, &finalists, &found, &mut told)?;
                Ok(Some(told))
            }
        }
    }

    fn begin(&self, chore: Chore, individuals: Vec<Individual>) -> Work {
        let mut work = Work { chore, individuals, trials: 0, found: Vec::new(), flight: None };
        work.trials = self.trials(&work).1.len();
        work
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
                let (arena, trials, plan) = self.trials(work);
                let batch = done..(done + arena.width().lanes()).min(trials.len());
                Flight::new(&trials[batch], arena.bench(plan, 1))?
            }
        };
        match flight.advance(PORTION)? {
            Some(found) => work.found.extend(found),
            None => work.flight = Some(flight),
        }
        Ok(work.found.len() >= work.trials)
    }

    /// All that is to be tried, where and how.
    fn trials<'a>(&self, work: &'a Work) -> (&Arena, Vec<Trial<'a>>, Plan) {
        let who = &work.individuals;
        match &work.chore {
            Chore::Generation(round) => {
                let arena = self.arena.ahead(round.ahead);
                (arena, arena.of_round(who, *round), arena.round_plan(*round))
            }
            Chore::Replays(told) => {
                let arena = self.arena.ahead(told.ahead);
                (arena, arena.trials(who), Plan::JUDGED)
            }
            Chore::Variations(told, _) => {
                let arena = self.arena.ahead(told.ahead);
                (arena, arena.varied(who), Plan::JUDGED)
            }
        }
    }
}
