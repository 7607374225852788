//! From a tree as data to one that runs: names become indices, what cannot be used is refused.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use ambulo_rig::Skeleton;
use ambulo_rig::glam::Vec2;

use crate::blend_space::{BlendSpace1, BlendSpace2};
use crate::blend_tree::{
    Amount, BlendTree, DEEPEST, Job, MOST, Node, Number, Space, TreeError, TreeProblem,
};
use crate::mask::{Mask, Part};
use crate::motion::Motion;

/// See [`BlendTree::new`].
pub(crate) fn build(
    root: &Node,
    clips: &BTreeMap<String, Arc<Motion>>,
    skeleton: &Skeleton,
) -> Result<BlendTree, TreeError> {
    let tree = BlendTree {
        rest: skeleton.rest_pose(),
        parameters: vec![],
        jobs: vec![],
        clocks: vec![],
        weights: 0,
    };
    let mut builder = Builder { tree, clips, skeleton, depth: 0 };
    builder.add(root, "", None)?;
    Ok(builder.tree)
}

struct Builder<'a> {
    tree: BlendTree,
    clips: &'a BTreeMap<String, Arc<Motion>>,
    skeleton: &'a Skeleton,
    depth: usize,
}

impl Builder<'_> {
    /// Adds a node after its children and returns its index. `shared` is the clock of the blend
    /// space above, if there is one.
    fn add(&mut self, node: &Node, above: &str, shared: Option<usize>) -> Result<usize, TreeError> {
        let kind = match node {
            Node::Clip { .. } => "clip",
            Node::Blend1 { .. } => "blend_1d",
            Node::Blend2 { .. } => "blend_2d",
            Node::Additive { .. } => "additive",
            Node::Overlay { .. } => "overlay",
            Node::Select { .. } => "select",
        };
        let path = if above.is_empty() { kind.into() } else { format!("{above}.{kind}") };
        let wrong = |problem| TreeError { path: path.clone(), problem };
        if self.depth == DEEPEST {
            return Err(wrong(TreeProblem::TooDeep));
        }
        self.depth += 1;
        let job = match node {
            Node::Clip { name, looped, speed } => {
                self.clip(name, *looped, *speed, shared).map_err(wrong)?
            }
            Node::Blend1 { by, samples } => {
                let places = samples.iter().map(|sample| sample.at).collect();
                let space = BlendSpace1::new(places).map_err(|e| wrong(e.into()))?;
                let space = Space::Line(space, self.parameter(by).map_err(wrong)?);
                self.blend(space, samples.iter().map(|sample| &sample.node), &path, shared)?
            }
            Node::Blend2 { by: [x, y], samples } => {
                let places = samples.iter().map(|sample| Vec2::from_array(sample.at)).collect();
                let space = BlendSpace2::new(places).map_err(|e| wrong(e.into()))?;
                let by = [self.parameter(x).map_err(wrong)?, self.parameter(y).map_err(wrong)?];
                let space = Space::Plane(space, by);
                self.blend(space, samples.iter().map(|sample| &sample.node), &path, shared)?
            }
            Node::Additive { base, add, reference, weight, mask } => {
                let weight = self.number(weight, -MOST..=MOST).map_err(wrong)?;
                let mask = self.mask(mask.as_deref()).map_err(wrong)?;
                let mut pose = self.tree.rest.clone();
                self.motion(reference).map_err(wrong)?.in_place(0.0, &mut pose);
                let base = self.add(base, &format!("{path}.base"), shared)?;
                let add = self.add(add, &format!("{path}.add"), shared)?;
                Job::Additive { base, add, reference: pose, weight, mask }
            }
            Node::Overlay { base, over, weight, mask } => {
                let weight = self.number(weight, 0.0..=1.0).map_err(wrong)?;
                let mask = self.mask(mask.as_deref()).map_err(wrong)?;
                let base = self.add(base, &format!("{path}.base"), shared)?;
                let over = self.add(over, &format!("{path}.over"), shared)?;
                Job::Overlay { base, over, weight, mask }
            }
            Node::Select { by, children } => {
                let by = self.parameter(by).map_err(wrong)?;
                if children.is_empty() {
                    return Err(wrong(TreeProblem::NoChild));
                }
                let mut added = Vec::with_capacity(children.len());
                for (index, child) in children.iter().enumerate() {
                    let first = self.tree.clocks.len();
                    let child = self.add(child, &format!("{path}.children[{index}]"), shared)?;
                    added.push((child, first..self.tree.clocks.len()));
                }
                Job::Select { by, children: added }
            }
        };
        self.depth -= 1;
        let index = self.tree.jobs.len();
        if let (Job::Clip { clock, .. } | Job::Blend { clock, .. }, None) = (&job, shared) {
            self.tree.clocks[*clock] = index;
        }
        self.tree.jobs.push(job);
        Ok(index)
    }

    fn clip(
        &mut self,
        name: &str,
        looped: bool,
        speed: f32,
        shared: Option<usize>,
    ) -> Result<Job, TreeProblem> {
        let motion = self.motion(name)?.clone();
        // Written so that NaN is refused too.
        if !(speed > 0.0 && speed <= MOST) {
            return Err(TreeProblem::Speed(speed));
        }
        if shared.is_some() && !looped {
            return Err(TreeProblem::Once);
        }
        Ok(Job::Clip { motion, looped, speed, clock: self.clock(shared) })
    }

    fn blend<'n>(
        &mut self,
        space: Space,
        nodes: impl Iterator<Item = &'n Node>,
        path: &str,
        shared: Option<usize>,
    ) -> Result<Job, TreeError> {
        let clock = self.clock(shared);
        let mut children = vec![];
        for (index, node) in nodes.enumerate() {
            let path = format!("{path}.samples[{index}].node");
            children.push(self.add(node, &path, Some(clock))?);
        }
        let first = self.tree.weights;
        self.tree.weights += children.len();
        Ok(Job::Blend { space, children, weights: first..self.tree.weights, clock })
    }

    /// That of the blend space above, else a new one.
    fn clock(&mut self, shared: Option<usize>) -> usize {
        shared.unwrap_or_else(|| {
            self.tree.clocks.push(usize::MAX);
            self.tree.clocks.len() - 1
        })
    }

    fn motion(&self, name: &str) -> Result<&Arc<Motion>, TreeProblem> {
        let motion = self.clips.get(name).ok_or_else(|| TreeProblem::NoClip(name.into()))?;
        let (expected, got) = (self.skeleton.len(), motion.joints());
        if expected != got {
            return Err(TreeProblem::Joints { clip: name.into(), expected, got });
        }
        Ok(motion)
    }

    fn mask(&self, parts: Option<&[Part]>) -> Result<Option<Mask>, TreeProblem> {
        Ok(parts.map(|parts| Mask::new(self.skeleton, parts)).transpose()?)
    }

    fn number(
        &mut self,
        amount: &Amount,
        range: RangeInclusive<f32>,
    ) -> Result<Number, TreeProblem> {
        match amount {
            Amount::Fixed(number) if range.contains(number) => Ok(Number::Fixed(*number)),
            Amount::Fixed(number) => Err(TreeProblem::Weight(*number)),
            Amount::Parameter(name) => Ok(Number::Parameter(self.parameter(name)?)),
        }
    }

    fn parameter(&mut self, name: &str) -> Result<usize, TreeProblem> {
        if name.is_empty() {
            return Err(TreeProblem::NoName);
        }
        Ok(self.tree.parameter(name).unwrap_or_else(|| {
            self.tree.parameters.push(name.into());
            self.tree.parameters.len() - 1
        }))
    }
}
