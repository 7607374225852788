//! A feed-forward network of any shape, as a string of numbers: what a genome of NEAT (Stanley and
//! Miikkulainen 2002) means.
//!
//! `[hidden, from, to, weight, from, to, weight, …]`: how many hidden nodes, then every connection.
//! Nodes are numbered: inputs from 0, the bias, which is always 1, at `inputs`, then outputs, then
//! hidden nodes. Connections to the same node stand together, and after all those that lead to where
//! they come from, so that one pass in their order is enough. Nothing leads to an input or to the bias,
//! and nothing comes from an output.

use crate::NetworkError;

/// A connection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The node it comes from.
    pub from: u32,
    /// The node it leads to.
    pub to: u32,
    /// What a value is multiplied by on the way.
    pub weight: f32,
}

/// A network that can be run.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    inputs: usize,
    outputs: usize,
    hidden: usize,
    edges: Vec<Edge>,
}

impl Graph {
    /// The most hidden nodes.
    pub const MOST_HIDDEN: usize = 65_536;

    /// Reads a genome.
    ///
    /// # Errors
    /// Numbers that are no whole triples, nodes that there are not, an order in which it cannot be run.
    pub fn parse(genome: &[f32], inputs: usize, outputs: usize) -> Result<Self, NetworkError> {
        let wrong = |reason: String| Err(NetworkError::Graph(reason));
        let whole = |number: f32, end: usize| {
            (number >= 0.0 && number < end as f32 && number.fract() == 0.0)
                .then_some(number as usize)
        };
        let Some((&hidden, rest)) = genome.split_first() else {
            return wrong("it is empty".into());
        };
        let Some(hidden) = whole(hidden, Self::MOST_HIDDEN + 1) else {
            return wrong(format!("{hidden} hidden nodes"));
        };
        if rest.len() % 3 != 0 {
            return wrong(format!("{} numbers of connections are no triples", rest.len()));
        }
        let (first_output, first_hidden) = (inputs + 1, inputs + 1 + outputs);
        let nodes = first_hidden + hidden;
        // Whether all that leads to a node has been seen, and whether it was used.
        let (mut done, mut used) = (vec![false; nodes], vec![false; nodes]);
        let mut edges: Vec<Edge> = Vec::with_capacity(rest.len() / 3);
        for (index, triple) in rest.chunks_exact(3).enumerate() {
            let (from, to, weight) = (whole(triple[0], nodes), whole(triple[1], nodes), triple[2]);
            let connection = format_args!("connection {index}: {triple:?}").to_string();
            let (Some(from), Some(to), true) = (from, to, weight.is_finite()) else {
                return wrong(connection);
            };
            if (first_output..first_hidden).contains(&from) || to < first_output {
                return wrong(format!("{connection} leads the wrong way"));
            }
            if let Some(before) = edges.last().filter(|before| before.to as usize != to) {
                done[before.to as usize] = true;
            }
            if done[to] || used[to] || from == to {
                return wrong(format!("{connection} comes too late"));
            }
            used[from] = true;
            edges.push(Edge { from: from as u32, to: to as u32, weight });
        }
        Ok(Self { inputs, outputs, hidden, edges })
    }

    /// How many hidden nodes.
    pub fn hidden(&self) -> usize {
        self.hidden
    }

    /// All connections, in the order in which they are run.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Runs it once. A node is the activation of the sum of what leads to it; one that nothing leads
    /// to is 0. `scratch` is what it likes; kept for the next run, nothing is allocated there.
    ///
    /// # Panics
    /// Other numbers of inputs or outputs than it was parsed for.
    pub fn run(
        &self,
        inputs: &[f32],
        outputs: &mut [f32],
        scratch: &mut Vec<f32>,
        activation: impl Fn(f32) -> f32,
    ) {
        assert_eq!((inputs.len(), outputs.len()), (self.inputs, self.outputs));
        scratch.clear();
        scratch.extend_from_slice(inputs);
        scratch.push(1.0);
        scratch.resize(self.inputs + 1 + self.outputs + self.hidden, 0.0);
        for edges in self.edges.chunk_by(|a, b| a.to == b.to) {
            let value = |edge: &Edge| edge.weight * scratch[edge.from as usize];
            let sum = edges.iter().map(value).sum();
            scratch[edges[0].to as usize] = activation(sum);
        }
        outputs.copy_from_slice(&scratch[self.inputs + 1..self.inputs + 1 + self.outputs]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two inputs, the bias 2, two outputs 3 and 4, hidden nodes 5 and 6.
    const GENOME: [f32; 19] = [
        2.0, 0.0, 6.0, 2.0, 2.0, 6.0, 1.0, 6.0, 5.0, 3.0, 5.0, 3.0, 1.0, 1.0, 3.0, -1.0, 6.0, 4.0,
        0.5,
    ];

    #[test]
    fn runs_as_its_formula_says() {
        let graph = Graph::parse(&GENOME, 2, 2).unwrap();
        assert_eq!((graph.hidden(), graph.edges().len()), (2, 6));
        let (mut outputs, mut scratch) = ([0.0; 2], vec![9.0; 50]);
        for _ in 0..2 {
            graph.run(&[3.0, 5.0], &mut outputs, &mut scratch, |x| x + 0.25);
            let six = 2.0 * 3.0 + 1.0 + 0.25;
            let five = 3.0 * six + 0.25;
            assert_eq!(outputs, [five - 5.0 + 0.25, 0.5 * six + 0.25]);
        }
        // Nothing leads there: 0, whatever the activation.
        Graph::parse(&[0.0], 2, 2).unwrap().run(&[1.0; 2], &mut outputs, &mut scratch, |_| 7.0);
        assert_eq!(outputs, [0.0; 2]);
    }

    #[test]
    fn refuses_what_cannot_be_run() {
        let refused = |genome: &[f32]| {
            Graph::parse(genome, 2, 2).expect_err(&format!("{genome:?}")).to_string()
        };
        assert!(refused(&[]).contains("empty"));
        for hidden in [-1.0, 0.5, f32::NAN, f32::INFINITY, 65_537.0] {
            assert!(refused(&[hidden]).contains("hidden nodes"));
        }
        assert!(refused(&[0.0, 1.0]).contains("no triples"));
        for [from, to, weight] in [
            [7.0, 3.0, 1.0],
            [0.0, 7.0, 1.0],
            [0.5, 3.0, 1.0],
            [-1.0, 3.0, 1.0],
            [0.0, 3.0, f32::NAN],
        ] {
            assert!(refused(&[2.0, from, to, weight]).contains("connection 0"));
        }
        for [from, to] in [[3.0, 4.0], [3.0, 5.0], [0.0, 1.0], [5.0, 2.0]] {
            assert!(refused(&[2.0, from, to, 1.0]).contains("the wrong way"));
        }
        // To itself; in a circle; used before it is done; not together.
        for late in [
            &[1.0, 5.0, 5.0, 1.0][..],
            &[2.0, 5.0, 6.0, 1.0, 6.0, 5.0, 1.0],
            &[1.0, 5.0, 3.0, 1.0, 0.0, 5.0, 1.0],
            &[1.0, 0.0, 3.0, 1.0, 0.0, 4.0, 1.0, 1.0, 3.0, 1.0],
        ] {
            assert!(refused(late).contains("too late"));
        }
    }
}
