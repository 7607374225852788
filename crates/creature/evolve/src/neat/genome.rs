//! A genome of NEAT: connections with historical markings.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::NeatSettings;
use super::inventions::Inventions;
use crate::common::state;
use ambulo_net::Graph;

use crate::{EvolveError, Random};

/// Changed by little: up to this share of the step.
const FINE: f64 = 0.1;

/// Changed by much: about so many.
const FEW: f64 = 6.0;

/// A connection gene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Link {
    /// Its historical marking: the same invention has the same, whoever carries it.
    pub mark: u32,
    pub from: u32,
    pub to: u32,
    pub weight: f32,
    pub on: bool,
}

/// Links by their marks. Nodes are inputs, bias, outputs, then hidden ones by the order in which they
/// were invented; there are those that links name. Links make no circles, not even with those off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Genome(pub Vec<Link>);

impl Genome {
    /// Every input and the bias to every output: "uniformly out of minimal structure".
    pub fn minimal(settings: &NeatSettings, random: &mut Random) -> Self {
        let from = 0..=settings.inputs as u32;
        let to = (0..settings.outputs as u32).map(|output| settings.inputs as u32 + 1 + output);
        let pairs = to.flat_map(|to| from.clone().map(move |from| (from, to)));
        let link = |(mark, (from, to)): (usize, (u32, u32))| {
            let weight = settings.limited(f64::from(settings.start) * random.normal());
            Link { mark: mark as u32, from, to, weight, on: true }
        };
        Self(pairs.enumerate().map(link).collect())
    }

    /// Equation 1: δ = c₁E/N + c₂D/N + c₃W̄, with N = 1 for genomes of fewer than 20 links.
    pub fn distance(&self, other: &Self, settings: &NeatSettings) -> f64 {
        let (mut excess, mut disjoint, mut matching, mut apart) = (0.0, 0.0, 0.0, 0.0);
        let (mut a, mut b) = (self.0.iter().peekable(), other.0.iter().peekable());
        loop {
            match (a.peek(), b.peek()) {
                (None, None) => break,
                (Some(x), Some(y)) if x.mark == y.mark => {
                    matching += 1.0;
                    apart += f64::from((x.weight - y.weight).abs());
                    a.next();
                    b.next();
                }
                (Some(x), Some(y)) => {
                    disjoint += 1.0;
                    let behind = if x.mark < y.mark { &mut a } else { &mut b };
                    behind.next();
                }
                _ => {
                    excess += 1.0;
                    a.next();
                    b.next();
                }
            }
        }
        let larger = self.0.len().max(other.0.len());
        let size = if larger < 20 { 1.0 } else { larger as f64 };
        settings.excess * excess / size
            + settings.disjoint * disjoint / size
            + settings.weights * apart / f64::max(matching, 1.0)
    }

    /// A child of two: matching links from either, all others from the fitter, so that no circle can
    /// come about; what is off in one of them is off three times in four.
    pub fn crossed(fitter: &Self, other: &Self, random: &mut Random) -> Self {
        let child = |link: &Link| {
            let Ok(at) = other.0.binary_search_by_key(&link.mark, |link| link.mark) else {
                return link.clone();
            };
            let mate = &other.0[at];
            let weight = if random.unit() < 0.5 { mate.weight } else { link.weight };
            let on = (link.on && mate.on) || random.unit() >= 0.75;
            Link { weight, on, ..link.clone() }
        };
        Self(fitter.0.iter().map(child).collect())
    }

    /// A new node, or else a new link, or else other weights: what is new is first tried as it is.
    pub fn mutate(&mut self, settings: &NeatSettings, made: &mut Inventions, random: &mut Random) {
        if random.unit() < settings.add_node {
            self.add_node(settings, made, random);
        } else if random.unit() < settings.add_link {
            self.add_link(settings, made, random);
        } else if random.unit() < settings.change_weights {
            self.change_weights(settings, random);
        }
    }

    /// All by little, or a few by much.
    fn change_weights(&mut self, settings: &NeatSettings, random: &mut Random) {
        let few = random.unit() >= settings.fine;
        let chance = if few { FEW / self.0.len() as f64 } else { 1.0 };
        let step = settings.weight_step * if few { 1.0 } else { FINE * random.unit() };
        for link in &mut self.0 {
            if random.unit() < chance {
                let anew = few && random.unit() < settings.new_weight;
                let (from, step) = match anew {
                    true => (0.0, f64::from(settings.start)),
                    false => (f64::from(link.weight), step),
                };
                link.weight = settings.limited(from + step * random.normal());
            }
        }
    }

    /// Splits a link: 1 on the way in, the old weight on the way out, so that little changes at first.
    fn add_node(&mut self, settings: &NeatSettings, made: &mut Inventions, random: &mut Random) {
        let on: Vec<_> = (0..self.0.len()).filter(|&at| self.0[at].on).collect();
        if on.is_empty() || self.hidden(settings).len() >= settings.most_hidden {
            return;
        }
        let at = on[random.below(on.len())];
        let Link { mark, from, to, weight, .. } = self.0[at];
        let node = made.node(mark);
        self.0[at].on = false;
        self.insert(made.link(from, node), from, node, 1.0);
        self.insert(made.link(node, to), node, to, weight);
    }

    /// Connects two nodes that are not; gives up after 20 pairs that cannot be.
    fn add_link(&mut self, settings: &NeatSettings, made: &mut Inventions, random: &mut Random) {
        let (inputs, hidden) = (settings.inputs as u32, settings.first_hidden());
        let mut nodes: Vec<_> = (0..hidden).collect();
        nodes.extend(self.hidden(settings));
        for _ in 0..20 {
            let (from, to) = (nodes[random.below(nodes.len())], nodes[random.below(nodes.len())]);
            let sends = from <= inputs || from >= hidden;
            let known = self.0.iter().any(|link| (link.from, link.to) == (from, to));
            if sends && to > inputs && !known && !self.reaches(to, from) {
                let weight = settings.limited(f64::from(settings.start) * random.normal());
                return self.insert(made.link(from, to), from, to, weight);
            }
        }
    }

    fn insert(&mut self, mark: u32, from: u32, to: u32, weight: f32) {
        let at = self.0.partition_point(|link| link.mark < mark);
        self.0.insert(at, Link { mark, from, to, weight, on: true });
    }

    fn hidden(&self, settings: &NeatSettings) -> BTreeSet<u32> {
        let nodes = self.0.iter().flat_map(|link| [link.from, link.to]);
        nodes.filter(|&node| node >= settings.first_hidden()).collect()
    }

    /// Whether a way leads from one node to another.
    fn reaches(&self, from: u32, to: u32) -> bool {
        let mut seen = vec![from];
        let mut next = 0;
        while next < seen.len() {
            let node = seen[next];
            if node == to {
                return true;
            }
            for link in self.0.iter().filter(|link| link.from == node) {
                if !seen.contains(&link.to) {
                    seen.push(link.to);
                }
            }
            next += 1;
        }
        false
    }

    /// As numbers, in the layout of [`Graph`]: only links that are on, and hidden nodes numbered anew
    /// in an order in which they can be run.
    pub fn encoded(&self, settings: &NeatSettings) -> Vec<f32> {
        let first = settings.first_hidden();
        let on: Vec<_> = self.0.iter().filter(|link| link.on).collect();
        // How many links still have to come before a hidden node is done; those without count 0.
        let mut waiting: BTreeMap<u32, usize> = BTreeMap::new();
        for link in &on {
            for node in [link.from, link.to].into_iter().filter(|&node| node >= first) {
                waiting.entry(node).or_insert(0);
            }
            if link.from >= first {
                *waiting.entry(link.to).or_insert(0) += 1;
            }
        }
        let mut order: Vec<_> = waiting
            .iter()
            .filter(|(node, n)| **node >= first && **n == 0)
            .map(|(&n, _)| n)
            .collect();
        let mut next = 0;
        while next < order.len() {
            let node = order[next];
            for link in on.iter().filter(|link| link.from == node && link.to >= first) {
                let left = waiting.get_mut(&link.to).expect("counted above");
                *left -= 1;
                if *left == 0 {
                    order.push(link.to);
                }
            }
            next += 1;
        }
        let number: BTreeMap<_, _> =
            order.iter().enumerate().map(|(at, &node)| (node, first + at as u32)).collect();
        let of = |node: u32| number.get(&node).copied().unwrap_or(node);
        let mut edges: Vec<_> =
            on.iter().map(|link| (of(link.to), of(link.from), link.weight)).collect();
        // Hidden nodes as they were numbered, outputs after them.
        edges.sort_by_key(|&(to, from, _)| (to < first, to, from));
        let numbers = edges.into_iter().flat_map(|(to, from, w)| [from as f32, to as f32, w]);
        [order.len() as f32].into_iter().chain(numbers).collect()
    }

    /// Checks a genome that was stored.
    pub fn check(&self, settings: &NeatSettings, made: &Inventions) -> Result<(), EvolveError> {
        state(self.0.is_sorted_by(|a, b| a.mark < b.mark), "links out of order")?;
        let known = |link: &Link| made.knows(link.mark, link.from.max(link.to));
        state(self.0.iter().all(known), "a link that nobody invented")?;
        let all = Self(self.0.iter().map(|link| Link { on: true, ..link.clone() }).collect());
        // Links in a circle are in one, however they are numbered.
        Graph::parse(&all.encoded(settings), settings.inputs, settings.outputs)
            .map(|_| ())
            .map_err(|error| EvolveError::Genome(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> NeatSettings {
        NeatSettings { inputs: 2, outputs: 1, ..NeatSettings::default() }
    }

    fn links(links: &[(u32, u32, u32, f32, bool)]) -> Genome {
        let link = |&(mark, from, to, weight, on)| Link { mark, from, to, weight, on };
        Genome(links.iter().map(link).collect())
    }

    /// As figure 4 of the paper: matching 1 to 5, disjoint 6, 7 and 8, excess 9 and 10.
    fn parents() -> (Genome, Genome) {
        let one = [1, 2, 3, 4, 5, 8].map(|mark| (mark, 0, mark + 3, 1.0, mark != 5));
        let two = [1, 2, 3, 4, 5, 6, 7, 9, 10].map(|mark| (mark, 0, mark + 3, 3.0, mark != 1));
        (links(&one), links(&two))
    }

    #[test]
    fn distance_is_equation_1() {
        let (one, two) = parents();
        let settings = NeatSettings { excess: 1.0, disjoint: 10.0, weights: 100.0, ..settings() };
        // Two excess, three disjoint, 2 apart in each weight; N is 1 below 20 links.
        assert_eq!(one.distance(&two, &settings), 2.0 + 30.0 + 200.0);
        assert_eq!(two.distance(&one, &settings), 232.0);
        assert_eq!(one.distance(&one, &settings), 0.0);
        let long = links(&(0..40).map(|mark| (mark, 0, 3, 1.0, true)).collect::<Vec<_>>());
        assert_eq!(long.distance(&links(&[]), &settings), 1.0);
    }

    #[test]
    fn crossover_takes_structure_from_the_fitter_and_weights_from_both() {
        let (one, two) = parents();
        let mut random = Random::new(1);
        let (mut threes, mut on) = (0, [0; 9]);
        for _ in 0..4000 {
            let child = Genome::crossed(&two, &one, &mut random);
            assert!(child.0.iter().map(|link| link.mark).eq([1, 2, 3, 4, 5, 6, 7, 9, 10]));
            assert!(child.0[5..].iter().all(|link| link.weight == 3.0));
            threes += child.0[..5].iter().filter(|link| link.weight == 3.0).count();
            child.0.iter().zip(&mut on).for_each(|(link, on)| *on += usize::from(link.on));
        }
        assert!((9_700..10_300).contains(&threes), "{threes} of 20000");
        // Off in one of them: on a quarter of the time.
        assert!((900..1100).contains(&on[0]) && (900..1100).contains(&on[4]), "{on:?}");
        assert!([1, 2, 3, 5, 6, 7, 8].iter().all(|&at| on[at] == 4000), "{on:?}");
    }

    #[test]
    fn a_new_node_splits_a_link_and_the_same_invention_has_the_same_marks() {
        let (settings, mut random) = (settings(), Random::new(1));
        let mut made = Inventions::new(&settings);
        let start = links(&[(0, 0, 3, 0.7, true)]);
        let mut children = [start.clone(), start.clone()];
        children.iter_mut().for_each(|child| child.add_node(&settings, &mut made, &mut random));
        let split = [(0, 0, 3, 0.7, false), (3, 0, 4, 1.0, true), (4, 4, 3, 0.7, true)];
        assert_eq!(children, [links(&split), links(&split)]);
        made.end_generation();
        let mut later = start;
        later.add_node(&settings, &mut made, &mut random);
        assert!(later.0[1..].iter().map(|link| (link.mark, link.to)).eq([(5, 5), (6, 3)]));
    }

    #[test]
    fn new_links_make_no_circles_and_no_doubles() {
        let settings = NeatSettings { outputs: 2, ..settings() };
        let mut made = Inventions::new(&settings);
        made.skip_to(10, 8);
        // 0 → 5 → 6 → 7 → 3, one of them off.
        let chain = [
            (0, 0, 5, 1.0, true),
            (1, 5, 6, 1.0, false),
            (2, 6, 7, 1.0, true),
            (3, 7, 3, 1.0, true),
        ];
        for seed in 0..50 {
            let (mut genome, mut random) = (links(&chain), Random::new(seed));
            (0..60).for_each(|_| genome.add_link(&settings, &mut made, &mut random));
            genome.check(&settings, &made).unwrap();
            let pairs: BTreeSet<_> = genome.0.iter().map(|link| (link.from, link.to)).collect();
            assert_eq!(pairs.len(), genome.0.len(), "doubles");
            // 3 senders and 3 hidden nodes to 2 outputs, 3 senders to 3 hidden nodes, 3 among these.
            assert!(pairs.len() > 20 && pairs.len() <= 24, "{}", pairs.len());
        }
    }

    #[test]
    fn is_encoded_as_it_can_be_run() {
        let settings = settings();
        // Hidden 9 comes before 5; 7 is cut off; the bias is 2 and the output 3.
        let genome = links(&[
            (0, 5, 3, 0.5, true),
            (1, 9, 5, 2.0, true),
            (2, 1, 9, 3.0, true),
            (3, 2, 3, 4.0, true),
            (4, 7, 3, 8.0, false),
        ]);
        let numbers = [2.0, 1.0, 4.0, 3.0, 4.0, 5.0, 2.0, 2.0, 3.0, 4.0, 5.0, 3.0, 0.5];
        assert_eq!(genome.encoded(&settings), numbers);
        let (mut output, mut scratch) = ([0.0], vec![]);
        let graph = Graph::parse(&numbers, 2, 1).unwrap();
        graph.run(&[9.0, 7.0], &mut output, &mut scratch, |x| x);
        assert_eq!(output, [0.5 * 2.0 * 3.0 * 7.0 + 4.0]);
    }

    #[test]
    fn a_stored_genome_with_a_circle_is_refused() {
        let (settings, mut made) = (settings(), Inventions::new(&settings()));
        made.skip_to(9, 9);
        let circle = [(0, 4, 5, 1.0, true), (1, 5, 4, 1.0, false), (2, 4, 3, 1.0, true)];
        assert!(links(&circle).check(&settings, &made).is_err());
        links(&circle[1..]).check(&settings, &made).unwrap();
        let beside = [(3, 6, 7, 1.0, true), (4, 7, 3, 1.0, true), (5, 6, 4, 1.0, true)];
        assert!(links(&[&circle[..], &beside].concat()).check(&settings, &made).is_err());
        assert!(
            links(&[(2, 4, 3, 1.0, true), (0, 4, 5, 1.0, true)]).check(&settings, &made).is_err()
        );
        assert!(links(&[(9, 4, 3, 1.0, true)]).check(&settings, &made).is_err());
        assert!(links(&[(0, 3, 4, 1.0, true)]).check(&settings, &made).is_err());
    }
}
