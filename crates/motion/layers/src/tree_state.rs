//! Runs a [`BlendTree`] for one character.

use ambulo_rig::Pose;
use ambulo_rig::glam::Vec2;

use crate::Refused;
use crate::blend::{self, Layer, additive, cross_fade, difference};
use crate::blend_tree::{BlendTree, Job, MOST, Space};
use crate::motion::GroundStep;
use crate::refused::check_number;

/// Longest step, seconds; more is a mistake.
const LONGEST: f32 = 3600.0;

/// Greatest parameter; more is a mistake.
const FARTHEST: f32 = 1e6;

/// Where a clip or a blend space is in its cycle, 0 to 1, before and after the last step.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    before: f64,
    now: f64,
    /// Cycles that began in between.
    rounds: i64,
}

/// What a step of a tree did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TreeStep {
    /// How the root went over the ground, in the frame that stood under it before the step.
    pub root: GroundStep,
    /// Whether a select node shows another child than before.
    pub switched: bool,
}

/// What one character needs to run a tree; all buffers are allocated once.
#[derive(Clone, Debug)]
pub struct TreeState {
    clocks: Vec<Clock>,
    /// Of the select nodes: the child that is shown.
    chosen: Vec<Option<usize>>,
    /// Seconds of a node's cycle; 0: it does not move.
    cycles: Vec<f64>,
    /// Whether a node has any weight in this step.
    active: Vec<bool>,
    weights: Vec<f32>,
    poses: Vec<Pose>,
    steps: Vec<GroundStep>,
    more: Pose,
}

impl TreeState {
    /// At the start of everything.
    pub fn new(tree: &BlendTree) -> Self {
        let nodes = tree.jobs.len();
        Self {
            clocks: vec![Clock::default(); tree.clocks.len()],
            chosen: vec![None; nodes],
            cycles: vec![0.0; nodes],
            active: vec![false; nodes],
            weights: vec![0.0; tree.weights],
            poses: vec![tree.rest.clone(); nodes],
            steps: vec![GroundStep::default(); nodes],
            more: tree.rest.clone(),
        }
    }
}

impl BlendTree {
    /// Whether a step with these parameters would show another child of a select node. Then a step
    /// of 0 seconds tells the new source's pose at the moment shown last, for the inertialiser.
    ///
    /// # Errors
    /// As in [`step`](Self::step).
    pub fn switches(&self, state: &mut TreeState, parameters: &[f32]) -> Result<bool, Refused> {
        self.check(state, parameters, 0.0)?;
        Ok(self.spread(state, parameters, false))
    }

    /// Moves on by `dt` seconds and writes the pose, its root over the origin, turned as its clips
    /// are at their start. `parameters` are in the order of [`parameters`](Self::parameters).
    /// Allocates nothing when `out` has the joints.
    ///
    /// # Errors
    /// A parameter too many or too few, or beyond ±10⁶, a `dt` that is negative, not finite or longer
    /// than an hour, a state of another size than this tree's; then nothing has changed. Additives
    /// upon each other that throw a joint farther than 10,000 km leave the output as it was.
    pub fn step(
        &self,
        state: &mut TreeState,
        parameters: &[f32],
        dt: f32,
        out: &mut Pose,
    ) -> Result<TreeStep, Refused> {
        self.check(state, parameters, dt)?;
        let switched = self.spread(state, parameters, true);
        self.tick(state, dt);
        for index in 0..self.jobs.len() {
            if state.active[index] {
                self.evaluate(index, state, parameters)?;
            }
        }
        let root = self.jobs.len() - 1;
        out.local.clone_from(&state.poses[root].local);
        Ok(TreeStep { root: state.steps[root], switched })
    }

    fn check(&self, state: &TreeState, parameters: &[f32], dt: f32) -> Result<(), Refused> {
        let counts = [
            (self.parameters.len(), parameters.len()),
            (self.jobs.len(), state.poses.len()),
            (self.clocks.len(), state.clocks.len()),
            (self.weights, state.weights.len()),
            (self.joints(), state.more.local.len()),
        ];
        if let Some(&(expected, got)) = counts.iter().find(|(expected, got)| expected != got) {
            return Err(Refused::Count { expected, got });
        }
        if !(0.0..=LONGEST).contains(&dt) {
            return Err(Refused::Time(dt));
        }
        parameters.iter().try_for_each(|&number| check_number(number, -FARTHEST, FARTHEST))
    }

    /// From the root down: which nodes have any weight. Returns whether a select node shows another
    /// child; keeps that if it is told to.
    fn spread(&self, state: &mut TreeState, parameters: &[f32], keep: bool) -> bool {
        let mut switched = false;
        state.active.fill(false);
        *state.active.last_mut().expect("a tree has a root") = true;
        for (index, job) in self.jobs.iter().enumerate().rev() {
            if !state.active[index] {
                continue;
            }
            match job {
                Job::Clip { .. } => {}
                Job::Blend { space, children, weights, .. } => {
                    let weights = &mut state.weights[weights.clone()];
                    weigh(space, parameters, weights);
                    for (&child, &weight) in children.iter().zip(&*weights) {
                        state.active[child] = weight > 0.0;
                    }
                }
                Job::Additive { base, add: over, weight, .. }
                | Job::Overlay { base, over, weight, .. } => {
                    state.active[*base] = true;
                    state.active[*over] = weight.value(parameters) != 0.0;
                }
                Job::Select { by, children } => {
                    let last = children.len() - 1;
                    let choice = (parameters[*by].round().max(0.0) as usize).min(last);
                    let (child, clocks) = &children[choice];
                    state.active[*child] = true;
                    if state.chosen[index] == Some(choice) {
                        continue;
                    }
                    switched |= state.chosen[index].is_some();
                    if keep {
                        state.chosen[index] = Some(choice);
                        state.clocks[clocks.clone()].fill(Clock::default());
                    }
                }
            }
        }
        switched
    }

    /// Sets how long every cycle lasts now and moves every clock that has any weight.
    fn tick(&self, state: &mut TreeState, dt: f32) {
        for (index, job) in self.jobs.iter().enumerate().filter(|(index, _)| state.active[*index]) {
            let below = &state.cycles[..index];
            state.cycles[index] = match job {
                Job::Clip { motion, speed, .. } => motion.duration() / f64::from(*speed),
                Job::Blend { children, weights, .. } => mean(
                    children
                        .iter()
                        .zip(&state.weights[weights.clone()])
                        .map(|(&child, &weight)| (below[child], f64::from(weight))),
                ),
                Job::Additive { base, .. } | Job::Overlay { base, .. } => below[*base],
                Job::Select { children, .. } => below[shown(children, state.chosen[index])],
            };
        }
        for (clock, &owner) in state.clocks.iter_mut().zip(&self.clocks) {
            let cycle = state.cycles[owner];
            let by = if state.active[owner] && cycle > 0.0 { f64::from(dt) / cycle } else { 0.0 };
            let looped = !matches!(self.jobs[owner], Job::Clip { looped: false, .. });
            clock.advance(by, looped);
        }
    }

    fn evaluate(
        &self,
        index: usize,
        state: &mut TreeState,
        parameters: &[f32],
    ) -> Result<(), Refused> {
        let (below, own) = state.poses.split_at_mut(index);
        let out = &mut own[0];
        let steps = &state.steps;
        state.steps[index] = match &self.jobs[index] {
            Job::Clip { motion, clock, .. } => {
                let Clock { before, now, rounds } = state.clocks[*clock];
                let [before, now] = [before, now].map(|at| at * motion.duration());
                motion.in_place(now, out);
                motion.way_between(before, now, rounds)
            }
            Job::Blend { children, weights, .. } => {
                let weights = &state.weights[weights.clone()];
                let parts = children.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
                let layers = parts.clone().map(|(&child, &weight)| Layer {
                    pose: &below[child],
                    weight,
                    mask: None,
                });
                blend::weighted(layers, &self.rest, out)?;
                parts.fold(GroundStep::default(), |sum, (&child, &weight)| GroundStep {
                    place: sum.place + steps[child].place * weight,
                    yaw: sum.yaw + steps[child].yaw * weight,
                })
            }
            Job::Additive { base, add, reference, weight, mask } => {
                let weight = weight.value(parameters).clamp(-MOST, MOST);
                difference(&below[*add], reference, &mut state.more)?;
                additive(&below[*base], &state.more, weight, mask.as_ref(), out)?;
                steps[*base]
            }
            Job::Overlay { base, over, weight, mask } => {
                let weight = weight.value(parameters);
                cross_fade(&below[*base], &below[*over], weight, mask.as_ref(), out)?;
                steps[*base]
            }
            Job::Select { children, .. } => {
                let child = shown(children, state.chosen[index]);
                out.local.clone_from(&below[child].local);
                steps[child]
            }
        };
        Ok(())
    }
}

impl Clock {
    fn advance(&mut self, by: f64, looped: bool) {
        self.before = self.now;
        let to = self.now + by;
        (self.now, self.rounds) =
            if looped { (to - to.floor(), to.floor() as i64) } else { (to.min(1.0), 0) };
    }
}

fn weigh(space: &Space, parameters: &[f32], weights: &mut [f32]) {
    let weighed = match space {
        Space::Line(space, by) => space.weights(parameters[*by], weights),
        Space::Plane(space, by) => {
            space.weights(Vec2::from_array(by.map(|by| parameters[by])), weights)
        }
    };
    weighed.expect("parameters are checked and there is a weight a child");
}

/// Of cycles that last any time, by weight.
fn mean(cycles: impl Iterator<Item = (f64, f64)>) -> f64 {
    let moving = cycles.filter(|(cycle, weight)| *cycle > 0.0 && *weight > 0.0);
    let (sum, total) = moving
        .fold((0.0, 0.0), |(sum, total), (cycle, weight)| (sum + cycle * weight, total + weight));
    if total > 0.0 { sum / total } else { 0.0 }
}

fn shown(children: &[(usize, std::ops::Range<usize>)], chosen: Option<usize>) -> usize {
    children[chosen.unwrap_or(0)].0
}

#[cfg(test)]
mod tests;
