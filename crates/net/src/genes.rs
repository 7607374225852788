//! A string of numbers that is no network by itself: whoever wrote it knows what each one means.

use crate::bundle::{BundleError, Tensor, Tensors, Weights};
use crate::network::check;

/// A genome in a bundle, with the numbers in and out of what is made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Genes {
    /// Numbers in and out.
    pub widths: [usize; 2],
    /// Its numbers.
    pub genome: Vec<f32>,
}

impl Weights for Genes {
    const KIND: &'static str = "genes";
    const ACTIVATIONS: &'static [&'static str] = &["none"];

    fn inputs(&self) -> usize {
        self.widths[0]
    }

    fn outputs(&self) -> usize {
        self.widths[1]
    }

    fn activation(&self) -> &'static str {
        "none"
    }

    fn names(_: usize) -> Vec<String> {
        vec!["genome".into(), "widths".into()]
    }

    fn tensors(&self) -> Vec<Tensor> {
        let tensor = |name: &str, values: Vec<f32>| {
            let shape = vec![values.len()];
            Tensor { name: name.into(), shape, values, may_be_half: false }
        };
        let widths = self.widths.map(|width| width as f32).to_vec();
        vec![tensor("genome", self.genome.clone()), tensor("widths", widths)]
    }

    fn read(tensors: &Tensors<'_>, _: &str) -> Result<Self, BundleError> {
        let (_, genome) = tensors.floats("genome")?;
        check("genome", &genome, genome.len())?;
        let (_, widths) = tensors.floats("widths")?;
        check("widths", &widths, 2)?;
        Ok(Self { widths: [widths[0] as usize, widths[1] as usize], genome })
    }
}
