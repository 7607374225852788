//! Historical markings of NEAT.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::NeatSettings;
use crate::EvolveError;
use crate::common::state;

/// What has been invented; within a generation, twice the same is once (section 3.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Inventions {
    next_mark: u32,
    next_node: u32,
    #[serde(skip)]
    links: BTreeMap<(u32, u32), u32>,
    /// The node that splits a link.
    #[serde(skip)]
    nodes: BTreeMap<u32, u32>,
}

impl Inventions {
    pub fn new(settings: &NeatSettings) -> Self {
        let next_mark = ((settings.inputs + 1) * settings.outputs) as u32;
        let next_node = (settings.inputs + 1 + settings.outputs) as u32;
        Self { next_mark, next_node, links: BTreeMap::new(), nodes: BTreeMap::new() }
    }

    /// Forgets who invented what; a later invention of the same is another.
    pub fn end_generation(&mut self) {
        self.links.clear();
        self.nodes.clear();
    }

    /// Checks what was stored; there are numbers left for as long as anybody waits.
    pub fn check(&self, settings: &NeatSettings) -> Result<(), EvolveError> {
        let least = Self::new(settings);
        let within = |next: u32, least: u32| (least..u32::MAX / 2).contains(&next);
        let sound =
            within(self.next_mark, least.next_mark) && within(self.next_node, least.next_node);
        state(sound, "more inventions than can be")
    }

    /// The mark of a link between two nodes.
    pub fn link(&mut self, from: u32, to: u32) -> u32 {
        *self.links.entry((from, to)).or_insert_with(|| {
            self.next_mark += 1;
            self.next_mark - 1
        })
    }

    /// The node that splits the link of this mark.
    pub fn node(&mut self, split: u32) -> u32 {
        *self.nodes.entry(split).or_insert_with(|| {
            self.next_node += 1;
            self.next_node - 1
        })
    }

    /// Whether there are this mark and this node.
    pub fn knows(&self, mark: u32, node: u32) -> bool {
        mark < self.next_mark && node < self.next_node
    }

    #[cfg(test)]
    pub fn skip_to(&mut self, mark: u32, node: u32) {
        (self.next_mark, self.next_node) = (mark, node);
    }
}
