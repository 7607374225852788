//! Layers, normalisation and the forward pass.

use crate::kernel::{Affine, affine, elu};
use crate::{CONTROL_POINTS, control_weights};

/// Largest width of a layer: far above any network of this kind, low enough that a broken file
/// cannot ask for memory it does not bring.
pub(crate) const MAX_WIDTH: usize = 1 << 16;

/// Why numbers are not a network.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum NetworkError {
    #[error("no graph of connections: {0}")]
    Graph(String),
    #[error("a network needs at least one layer")]
    Empty,
    #[error("'{tensor}': expected {expected} numbers, got {got}")]
    Count { tensor: String, expected: usize, got: usize },
    #[error("'{tensor}': number {index} is {value}, expected a finite number")]
    NotFinite { tensor: String, index: usize, value: f32 },
    #[error("'{tensor}': number {index} is {value}, expected a deviation above 0")]
    Deviation { tensor: String, index: usize, value: f32 },
    #[error("layer {layer}: takes {takes} numbers, but {gets} arrive")]
    Chain { layer: usize, takes: usize, gets: usize },
    #[error("layer {layer}: {inputs} × {outputs} is not between 1 and 65536 a side")]
    Width { layer: usize, inputs: usize, outputs: usize },
}

/// One affine layer with its four control points.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    inputs: usize,
    outputs: usize,
    /// outputs × 4 × inputs: the control points of a row lie beside each other.
    weights: Vec<f32>,
    /// outputs × 4.
    biases: Vec<f32>,
}

impl Layer {
    /// Takes `weights` as 4 × outputs × inputs and `biases` as 4 × outputs, row-major, and the
    /// layer's index for messages.
    ///
    /// # Errors
    /// Counts that do not fit, numbers that are not finite.
    pub fn new(
        index: usize,
        inputs: usize,
        outputs: usize,
        weights: &[f32],
        biases: &[f32],
    ) -> Result<Self, NetworkError> {
        if !(1..=MAX_WIDTH).contains(&inputs) || !(1..=MAX_WIDTH).contains(&outputs) {
            return Err(NetworkError::Width { layer: index, inputs, outputs });
        }
        check(&format!("layers.{index}.weight"), weights, CONTROL_POINTS * outputs * inputs)?;
        check(&format!("layers.{index}.bias"), biases, CONTROL_POINTS * outputs)?;
        let mut interleaved = Vec::with_capacity(weights.len());
        for row in 0..outputs {
            for point in 0..CONTROL_POINTS {
                interleaved
                    .extend_from_slice(&weights[(point * outputs + row) * inputs..][..inputs]);
            }
        }
        let rows = 0..outputs;
        let biases =
            rows.flat_map(|row| (0..CONTROL_POINTS).map(move |p| biases[p * outputs + row]));
        Ok(Self { inputs, outputs, weights: interleaved, biases: biases.collect() })
    }

    /// Numbers in.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Numbers out.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// The weights as 4 × outputs × inputs, as [`Layer::new`] takes them.
    pub fn weights(&self) -> Vec<f32> {
        let points = 0..CONTROL_POINTS;
        let rows = points.flat_map(|p| (0..self.outputs).map(move |row| row * CONTROL_POINTS + p));
        rows.flat_map(|row| &self.weights[row * self.inputs..][..self.inputs]).copied().collect()
    }

    /// The biases as 4 × outputs.
    pub fn biases(&self) -> Vec<f32> {
        let points = 0..CONTROL_POINTS;
        points.flat_map(|p| self.biases.iter().skip(p).step_by(CONTROL_POINTS)).copied().collect()
    }

    fn run(&self, shares: [f32; CONTROL_POINTS], x: &[f32], out: &mut Vec<f32>) {
        out.resize(self.outputs, 0.0);
        affine(Affine { weights: &self.weights, biases: &self.biases, shares }, x, out);
    }
}

/// Means and deviations of the vectors outside: networks see and give (v − mean) / deviation.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Normalisation {
    pub input_mean: Vec<f32>,
    pub input_std: Vec<f32>,
    pub output_mean: Vec<f32>,
    pub output_std: Vec<f32>,
}

/// Buffers of one forward pass; make it once, use it every frame.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    from: Vec<f32>,
    to: Vec<f32>,
}

/// A phase-functioned network: ELU after every layer but the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    layers: Vec<Layer>,
    normalisation: Normalisation,
}

impl Network {
    /// Checks that the layers form a chain and that the normalisation fits its ends.
    ///
    /// # Errors
    /// No layer, widths that do not meet, means or deviations of another length, a number that is
    /// not finite, a deviation that is not above 0.
    pub fn new(layers: Vec<Layer>, normalisation: Normalisation) -> Result<Self, NetworkError> {
        let (first, last) = match (layers.first(), layers.last()) {
            (Some(first), Some(last)) => (first, last),
            _ => return Err(NetworkError::Empty),
        };
        for (index, pair) in layers.windows(2).enumerate() {
            let (gets, takes) = (pair[0].outputs, pair[1].inputs);
            if gets != takes {
                return Err(NetworkError::Chain { layer: index + 1, takes, gets });
            }
        }
        let n = &normalisation;
        check("input.mean", &n.input_mean, first.inputs)?;
        check("input.std", &n.input_std, first.inputs)?;
        check("output.mean", &n.output_mean, last.outputs)?;
        check("output.std", &n.output_std, last.outputs)?;
        for (tensor, values) in [("input.std", &n.input_std), ("output.std", &n.output_std)] {
            if let Some(index) = values.iter().position(|&v| v <= 0.0) {
                let (tensor, value) = (tensor.into(), values[index]);
                return Err(NetworkError::Deviation { tensor, index, value });
            }
        }
        Ok(Self { layers, normalisation })
    }

    /// Numbers in.
    pub fn inputs(&self) -> usize {
        self.normalisation.input_mean.len()
    }

    /// Numbers out.
    pub fn outputs(&self) -> usize {
        self.normalisation.output_mean.len()
    }

    /// First to last.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Means and deviations of both ends.
    pub fn normalisation(&self) -> &Normalisation {
        &self.normalisation
    }

    /// Buffers for [`Network::predict`].
    pub fn scratch(&self) -> Scratch {
        let width = self.layers.iter().map(|l| l.outputs.max(l.inputs)).max().unwrap_or(0);
        Scratch { from: Vec::with_capacity(width), to: Vec::with_capacity(width) }
    }

    /// One forward pass: `x` and `y` are not normalised, `phase` is in radians. Allocates nothing.
    ///
    /// # Panics
    /// When `x` or `y` have not the network's lengths.
    pub fn predict(&self, x: &[f32], phase: f32, y: &mut [f32], scratch: &mut Scratch) {
        assert_eq!(x.len(), self.inputs(), "numbers in");
        assert_eq!(y.len(), self.outputs(), "numbers out");
        let shares = control_weights(phase);
        let n = &self.normalisation;
        let Scratch { from, to } = scratch;
        from.clear();
        from.extend((0..x.len()).map(|i| (x[i] - n.input_mean[i]) / n.input_std[i]));
        let (last, hidden) = self.layers.split_last().expect("at least one layer");
        for layer in hidden {
            layer.run(shares, from, to);
            to.iter_mut().for_each(|value| *value = elu(*value));
            std::mem::swap(from, to);
        }
        last.run(shares, from, to);
        for (i, value) in to.iter().enumerate() {
            y[i] = value * n.output_std[i] + n.output_mean[i];
        }
    }
}

pub(crate) fn check(tensor: &str, values: &[f32], expected: usize) -> Result<(), NetworkError> {
    if values.len() != expected {
        let (tensor, got) = (tensor.into(), values.len());
        return Err(NetworkError::Count { tensor, expected, got });
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => {
            Err(NetworkError::NotFinite { tensor: tensor.into(), index, value: values[index] })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// Numbers in [-1, 1) that look random and are the same everywhere.
    pub fn numbers(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12345);
        let next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        std::iter::repeat_with(next).take(count).collect()
    }

    pub fn network(sizes: &[usize]) -> Network {
        let layers = sizes.windows(2).enumerate().map(|(index, pair)| {
            let (inputs, outputs) = (pair[0], pair[1]);
            let weights: Vec<_> = numbers(4 * inputs * outputs, index as u32)
                .into_iter()
                .map(|w| w / (inputs as f32).sqrt())
                .collect();
            Layer::new(index, inputs, outputs, &weights, &numbers(4 * outputs, 99)).unwrap()
        });
        let positive = |count| numbers(count, 5).into_iter().map(|v| v.abs() + 0.1).collect();
        let (inputs, outputs) = (sizes[0], sizes[sizes.len() - 1]);
        Network::new(
            layers.collect(),
            Normalisation {
                input_mean: numbers(inputs, 6),
                input_std: positive(inputs),
                output_mean: numbers(outputs, 7),
                output_std: positive(outputs),
            },
        )
        .unwrap()
    }

    /// The definition, in f64: blend the weights first, then multiply.
    fn reference(network: &Network, x: &[f32], phase: f32) -> Vec<f64> {
        let shares = control_weights(phase).map(f64::from);
        let n = network.normalisation();
        let mut h: Vec<f64> = (0..x.len())
            .map(|i| (f64::from(x[i]) - f64::from(n.input_mean[i])) / f64::from(n.input_std[i]))
            .collect();
        for (index, layer) in network.layers().iter().enumerate() {
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            let (weights, biases) = (layer.weights(), layer.biases());
            let blend = |values: &[f32], stride: usize, at: usize| -> f64 {
                (0..4).map(|p| shares[p] * f64::from(values[p * stride + at])).sum()
            };
            let out = (0..outputs).map(|row| {
                let products =
                    (0..inputs).map(|i| blend(&weights, outputs * inputs, row * inputs + i) * h[i]);
                let sum = products.sum::<f64>() + blend(&biases, outputs, row);
                let hidden = index + 1 < network.layers().len();
                if hidden && sum < 0.0 { sum.exp() - 1.0 } else { sum }
            });
            h = out.collect();
        }
        let scaled = h.iter().enumerate();
        scaled.map(|(i, v)| v * f64::from(n.output_std[i]) + f64::from(n.output_mean[i])).collect()
    }

    #[test]
    fn agrees_with_the_definition_in_f64() {
        for sizes in [&[5, 3][..], &[19, 32, 11], &[40, 64, 64, 33], &[342, 512, 512, 311]] {
            let network = network(sizes);
            let mut scratch = network.scratch();
            let mut y = vec![0.0; network.outputs()];
            for (seed, phase) in [(1, 0.0), (2, 1.0), (3, TAU - 1e-3), (4, -2.0), (5, 17.0)] {
                let x = numbers(network.inputs(), seed);
                network.predict(&x, phase, &mut y, &mut scratch);
                for (i, expected) in reference(&network, &x, phase).into_iter().enumerate() {
                    let error = (f64::from(y[i]) - expected).abs();
                    let std = f64::from(network.normalisation().output_std[i]);
                    assert!(error <= 1e-5 * expected.abs().max(std), "{sizes:?} {i}: {error}");
                }
            }
        }
    }

    #[test]
    fn layers_give_back_what_they_took() {
        let (weights, biases) = (numbers(4 * 3 * 5, 1), numbers(4 * 3, 2));
        let layer = Layer::new(0, 5, 3, &weights, &biases).unwrap();
        assert_eq!(layer.weights(), weights);
        assert_eq!(layer.biases(), biases);
    }

    #[test]
    fn refuses_by_name() {
        let short = Layer::new(2, 5, 3, &[0.0; 59], &[0.0; 12]).unwrap_err();
        assert_eq!(short.to_string(), "'layers.2.weight': expected 60 numbers, got 59");
        let mut weights = [0.0; 60];
        weights[7] = f32::NAN;
        let nan = Layer::new(0, 5, 3, &weights, &[0.0; 12]).unwrap_err().to_string();
        assert_eq!(nan, "'layers.0.weight': number 7 is NaN, expected a finite number");
        let whole = network(&[4, 6, 2]);
        let [a, b] = [0, 1].map(|i| whole.layers()[i].clone());
        let n = whole.normalisation().clone();
        let chain = Network::new(vec![b.clone(), a.clone()], n.clone()).unwrap_err();
        assert_eq!(chain, NetworkError::Chain { layer: 1, takes: 4, gets: 2 });
        let mut zero = n.clone();
        zero.input_std[1] = 0.0;
        let zero = Network::new(vec![a.clone(), b.clone()], zero).unwrap_err();
        assert!(matches!(zero, NetworkError::Deviation { index: 1, .. }));
        let mut short = n;
        short.output_mean.pop();
        assert!(matches!(Network::new(vec![a, b], short), Err(NetworkError::Count { .. })));
        assert!(matches!(Layer::new(0, 0, 3, &[], &[]), Err(NetworkError::Width { .. })));
    }
}
