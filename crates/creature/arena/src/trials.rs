//! Trying individuals, as many at a time as there are lanes, on all cores.

use std::any::Any;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use ambulo_body::Body;
use ambulo_lanes::{Job, Scalar, Simd, Width};
use ambulo_pilot::{Pilots, Settings as ControllerSettings};
use ambulo_world::{Ground, Lockstep, Physics, Solver, World, WorldError};

use crate::ArenaError;
use crate::episode::{Crew, Episode, Plan};
use crate::meter::Tally;

/// The most individuals that share a Box2D world, and the most parts of all of them: a world costs
/// time of its own, but the engine looks through all parts that are near each other.
const MOST_TOGETHER: usize = 12;
const MOST_PARTS_TOGETHER: usize = 48;

/// A genome and the body that it means.
#[derive(Clone, Debug)]
pub(crate) struct Individual {
    pub genome: Vec<f32>,
    /// How many of the genome's numbers, the first ones, are the controller's.
    pub steering: usize,
    pub body: Arc<Body>,
}

impl Individual {
    /// What steers it.
    pub fn genes(&self) -> &[f32] {
        &self.genome[..self.steering]
    }
}

/// An individual to be tried.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial<'a> {
    pub individual: &'a Individual,
    pub physics: Physics,
    /// Seed of the pushes that it gets, if any.
    pub pushes: Option<u64>,
}

/// How trials are made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bench<'a> {
    pub controller: &'a ControllerSettings,
    pub width: Width,
    pub threads: usize,
    pub plan: Plan,
}

/// What was measured of each; nothing where a controller or the world gave what is not a number.
/// Trials must be of one creature, whose measures may differ, and of one solver and ground.
pub(crate) fn tried(
    trials: &[Trial<'_>],
    bench: Bench<'_>,
) -> Result<Vec<Option<Tally>>, ArenaError> {
    let Some(first) = trials.first() else { return Ok(vec![]) };
    let together = match first.physics.solver {
        Solver::Lockstep => bench.width.lanes(),
        Solver::Box2d => match first.physics.ground {
            Ground::Flat => {
                (MOST_PARTS_TOGETHER / first.individual.body.parts().len()).clamp(1, MOST_TOGETHER)
            }
            _ => 1,
        },
    };
    let threads = bench.threads.clamp(1, trials.len());
    // Full lanes cost no more than empty ones; Box2D's worlds are made of one size.
    let batches: Vec<_> = match first.physics.solver {
        Solver::Lockstep => {
            let starts = (0..trials.len()).step_by(together);
            starts.map(|start| start..(start + together).min(trials.len())).collect()
        }
        Solver::Box2d => {
            let count = threads * trials.len().div_ceil(threads * together);
            let bound = |batch: usize| batch * trials.len() / count;
            (0..count).map(|batch| bound(batch)..bound(batch + 1)).collect()
        }
    };
    let next = AtomicUsize::new(0);
    let found: Mutex<Vec<Option<Tally>>> = Mutex::new(vec![None; trials.len()]);
    let work = || -> Result<(), ArenaError> {
        loop {
            let batch = next.fetch_add(1, Ordering::Relaxed);
            let Some(range) = batches.get(batch) else { return Ok(()) };
            let tallies = batch_of(&trials[range.clone()], bench)?;
            let mut found = found.lock().expect("nothing panics with it");
            range.clone().zip(tallies).for_each(|(index, tally)| found[index] = tally);
        }
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(batches.len())).map(|_| scope.spawn(work)).collect();
        let mine = work();
        let theirs = others.into_iter().map(|thread| thread.join().expect("no panic"));
        theirs.fold(mine, Result::and)
    })?;
    Ok(found.into_inner().expect("nothing panics with it"))
}

/// Trials that share lanes or a world.
fn batch_of(trials: &[Trial<'_>], bench: Bench<'_>) -> Result<Vec<Option<Tally>>, ArenaError> {
    if trials.is_empty() {
        return Ok(vec![]);
    }
    if trials[0].physics.solver == Solver::Lockstep {
        // What is left over is done soonest with as few lanes as hold it.
        let fits = |width: &Width| width.lanes() >= trials.len() && *width <= bench.width;
        let width = Width::available().find(fits).expect("a batch fits its lanes");
        return width.run(InLanes { trials, bench });
    }
    let alike = |pair: &[Trial<'_>]| {
        pair[0].physics == pair[1].physics
            && Arc::ptr_eq(&pair[0].individual.body, &pair[1].individual.body)
    };
    let shared = trials.windows(2).all(alike);
    let each_alone = || {
        let alone = trials.iter();
        alone.map(|trial| Ok(batch_of(std::slice::from_ref(trial), bench)?.remove(0))).collect()
    };
    if !shared {
        return each_alone();
    }
    match in_box2d(trials, bench) {
        // Whoever broke the world must not spoil it for the others.
        Err(ArenaError::World(WorldError::Engine(_))) if trials.len() > 1 => each_alone(),
        Err(ArenaError::World(WorldError::Engine(_))) => Ok(vec![None]),
        other => other,
    }
}

/// Trials as a job for any width.
struct InLanes<'a> {
    trials: &'a [Trial<'a>],
    bench: Bench<'a>,
}

impl Job for InLanes<'_> {
    type Output = Result<Vec<Option<Tally>>, ArenaError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let plan = self.bench.plan;
        let mut episode = in_lanes(simd, self.trials, self.bench.controller, plan)?;
        episode.advance(&self.trials[0].individual.body, plan.steps, |_, _, _| {})?;
        Ok(tallies(&episode.crews[0], self.trials.len()))
    }
}

/// A batch that is tried bit by bit; in Box2D all at once.
pub(crate) struct Flight {
    width: Width,
    bodies: Vec<Arc<Body>>,
    /// An `Episode` of the width's lanes, or what Box2D has found.
    episode: Result<Box<dyn Any>, Vec<Option<Tally>>>,
}

impl Flight {
    /// At its start: at most as many trials as there are lanes.
    pub fn new(trials: &[Trial<'_>], bench: Bench<'_>) -> Result<Self, ArenaError> {
        let episode = match trials[0].physics.solver {
            Solver::Lockstep => Ok(bench.width.run(Begin(InLanes { trials, bench }))?),
            Solver::Box2d => Err(batch_of(trials, bench)?),
        };
        let bodies = trials.iter().map(|trial| trial.individual.body.clone()).collect();
        Ok(Self { width: bench.width, bodies, episode })
    }

    /// Goes on for so many steps; what was measured once it is over.
    pub fn advance(&mut self, steps: u32) -> Result<Option<Vec<Option<Tally>>>, ArenaError> {
        match &mut self.episode {
            Ok(episode) => {
                self.width.run(Advance { episode: &mut **episode, bodies: &self.bodies, steps })
            }
            Err(found) => Ok(Some(std::mem::take(found))),
        }
    }
}

struct Begin<'a>(InLanes<'a>);

impl Job for Begin<'_> {
    type Output = Result<Box<dyn Any>, ArenaError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let InLanes { trials, bench } = self.0;
        Ok(Box::new(in_lanes(simd, trials, bench.controller, bench.plan)?))
    }
}

struct Advance<'a> {
    episode: &'a mut dyn Any,
    bodies: &'a [Arc<Body>],
    steps: u32,
}

impl Job for Advance<'_> {
    type Output = Result<Option<Vec<Option<Tally>>>, ArenaError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let episode = self.episode.downcast_mut::<Episode<S, Lockstep<S>>>();
        let episode = episode.expect("it was begun with as many lanes");
        let over = episode.advance(&self.bodies[0], self.steps, |_, _, _| {})?;
        Ok(over.then(|| tallies(&episode.crews[0], self.bodies.len())))
    }
}

/// An episode of individuals in lanes, at its start.
pub(crate) fn in_lanes<S: Simd>(
    simd: S,
    trials: &[Trial<'_>],
    controller: &ControllerSettings,
    plan: Plan,
) -> Result<Episode<S, Lockstep<S>>, ArenaError> {
    let bodies: Vec<&Body> = trials.iter().map(|trial| &*trial.individual.body).collect();
    let physics = trials.iter().map(|trial| &trial.physics);
    let world = Lockstep::new(simd, &bodies.iter().copied().zip(physics).collect::<Vec<_>>())?;
    let genes = trials.iter().map(|trial| trial.individual.genes());
    let minds: Vec<_> = bodies.iter().copied().zip(genes).collect();
    let pilots = Pilots::new(simd, controller, &minds)?;
    let seeds: Vec<_> = trials.iter().map(|trial| trial.pushes).collect();
    let crew = Crew::new(simd, &world, 0, &bodies, pilots, &seeds, plan);
    Ok(Episode::new(world, vec![crew], bodies[0], plan))
}

/// An episode of individuals in a Box2D world, at its start.
pub(crate) fn in_world(
    trials: &[Trial<'_>],
    controller: &ControllerSettings,
    plan: Plan,
) -> Result<Episode<Scalar, World>, ArenaError> {
    let body = &*trials[0].individual.body;
    let world = World::new(body, &trials[0].physics, trials.len())?;
    let crew = |(group, trial): (usize, &Trial<'_>)| {
        let pilots = Pilots::new(Scalar, controller, &[(body, trial.individual.genes())])?;
        Ok(Crew::new(Scalar, &world, group, &[body], pilots, &[trial.pushes], plan))
    };
    let crews = trials.iter().enumerate().map(crew).collect::<Result<Vec<_>, ArenaError>>()?;
    Ok(Episode::new(world, crews, body, plan))
}

fn in_box2d(trials: &[Trial<'_>], bench: Bench<'_>) -> Result<Vec<Option<Tally>>, ArenaError> {
    let mut episode = in_world(trials, bench.controller, bench.plan)?;
    let body = &trials[0].individual.body;
    episode.advance(body, bench.plan.steps, |_, _, _| {})?;
    Ok(episode.crews.iter().flat_map(|crew| tallies(crew, 1)).collect())
}

/// What was measured in so many lanes; nothing where it is not a number.
fn tallies<S: Simd>(crew: &Crew<S>, lanes: usize) -> Vec<Option<Tally>> {
    let of = |lane: usize| {
        let tally = crew.meter.tally(lane);
        let sane = !crew.lost.lane(lane) && tally.end.iter().all(|value| value.is_finite());
        sane.then_some(tally)
    };
    (0..lanes).map(of).collect()
}
