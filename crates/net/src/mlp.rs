//! A fully connected network whose weights are one string of numbers: a genome.
//!
//! The controller of Gegendorfer, "Using Neuroevolution for Physics-Based Character Animation in
//! Two Dimensions" (TU Wien, 2017), sections 3.1.2 and 4.2.2: a bias for every layer, the same
//! activation after each, the output layer's included.

use ambulo_lanes::{Lanes, Scalar, Simd, math};
use serde::{Deserialize, Serialize};

use crate::bundle::{BundleError, Tensor, Tensors, Weights, layer_names};
use crate::network::{MAX_WIDTH, NetworkError, check};

/// What a neuron makes of the sum of its inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// 1 / (1 + exp(−a)): 0 to 1.
    Logistic,
    /// (1 − exp(−2a)) / (1 + exp(−2a)): −1 to 1.
    #[default]
    Tanh,
    /// a (27 + a²) / (27 + 9a²), held within −1 to 1: within 0.024 of tanh, and cheaper.
    CheapTanh,
}

impl Activation {
    /// All of them.
    pub const ALL: [Activation; 3] =
        [Activation::Logistic, Activation::Tanh, Activation::CheapTanh];

    /// Its name in a bundle's header.
    pub fn name(self) -> &'static str {
        match self {
            Activation::Logistic => "logistic",
            Activation::Tanh => "tanh",
            Activation::CheapTanh => "cheap_tanh",
        }
    }

    /// Its value; the same bits on every machine.
    pub fn of(self, a: f32) -> f32 {
        self.of_lanes(Lanes::<Scalar>::from(a)).value()
    }

    /// Its value in every lane.
    #[inline(always)]
    pub fn of_lanes<S: Simd>(self, a: Lanes<S>) -> Lanes<S> {
        match self {
            Activation::Logistic => math::logistic(a),
            Activation::Tanh => math::tanh(a),
            Activation::CheapTanh => {
                // It reaches ±1 at ±3; held this way around, what is not a number stays one.
                let three = a.like(3.0);
                let a = a.greater(three).choose(three, a);
                let a = a.less(-three).choose(-three, a);
                let square = a * a;
                a * (square + 27.0) / (square * 9.0 + 27.0)
            }
        }
    }
}

/// A fully connected network.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    widths: Vec<usize>,
    genome: Vec<f32>,
    /// The genome by inputs, then neurons, biases last: neighbours are summed side by side.
    columns: Vec<f32>,
    activation: Activation,
    gain: f32,
}

/// Buffers of one forward pass; make it once, use it every step.
#[derive(Clone, Debug, Default)]
pub struct MlpScratch {
    from: Vec<f32>,
    to: Vec<f32>,
}

impl Mlp {
    /// How many numbers a network of such widths (first input to last output) has.
    pub fn genes(widths: &[usize]) -> usize {
        widths.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
    }

    /// `genome`: layer by layer, neuron by neuron, its weights and then its bias. What a layer
    /// gives is `gain` times its activation.
    ///
    /// # Errors
    /// No layer, widths that are not 1 to 65536, a genome of another length, numbers that are not
    /// finite.
    pub fn new(
        widths: &[usize],
        genome: &[f32],
        activation: Activation,
        gain: f32,
    ) -> Result<Self, NetworkError> {
        if widths.len() < 2 {
            return Err(NetworkError::Empty);
        }
        for (layer, pair) in widths.windows(2).enumerate() {
            let (inputs, outputs) = (pair[0], pair[1]);
            if !(1..=MAX_WIDTH).contains(&inputs) || !(1..=MAX_WIDTH).contains(&outputs) {
                return Err(NetworkError::Width { layer, inputs, outputs });
            }
        }
        check("genome", genome, Self::genes(widths))?;
        check("gain", &[gain], 1)?;
        let mut columns = Vec::with_capacity(genome.len());
        let mut rest = genome;
        for pair in widths.windows(2) {
            let (layer, after) = rest.split_at((pair[0] + 1) * pair[1]);
            let inputs = 0..=pair[0];
            columns.extend(inputs.flat_map(|i| layer.iter().skip(i).step_by(pair[0] + 1)));
            rest = after;
        }
        Ok(Self { widths: widths.to_vec(), genome: genome.to_vec(), columns, activation, gain })
    }

    /// Numbers of the layers, first input to last output.
    pub fn widths(&self) -> &[usize] {
        &self.widths
    }

    /// Its numbers, as [`Mlp::new`] takes them.
    pub fn genome(&self) -> &[f32] {
        &self.genome
    }

    /// The activation of every layer.
    pub fn activation(&self) -> Activation {
        self.activation
    }

    /// What every layer's activation is multiplied with.
    pub fn gain(&self) -> f32 {
        self.gain
    }

    /// Buffers for [`Mlp::predict`].
    pub fn scratch(&self) -> MlpScratch {
        let width = self.widths.iter().copied().max().unwrap_or(0);
        MlpScratch { from: Vec::with_capacity(width), to: Vec::with_capacity(width) }
    }

    /// One forward pass. Allocates nothing. The same bits on every machine: sums run over the
    /// inputs in order, and no product is fused with its sum.
    ///
    /// # Panics
    /// When `x` or `y` have not the network's lengths.
    pub fn predict(&self, x: &[f32], y: &mut [f32], scratch: &mut MlpScratch) {
        assert_eq!(x.len(), self.widths[0], "numbers in");
        assert_eq!(y.len(), self.widths[self.widths.len() - 1], "numbers out");
        let MlpScratch { from, to } = scratch;
        from.clear();
        from.extend_from_slice(x);
        let mut rest = &self.columns[..];
        for pair in self.widths.windows(2) {
            let outputs = pair[1];
            let (layer, after) = rest.split_at((pair[0] + 1) * outputs);
            let (weights, biases) = layer.split_at(pair[0] * outputs);
            to.clear();
            to.extend_from_slice(biases);
            for (input, column) in from.iter().zip(weights.chunks_exact(outputs)) {
                for (sum, weight) in to.iter_mut().zip(column) {
                    *sum += weight * input;
                }
            }
            for sum in to.iter_mut() {
                *sum = self.activation.of(*sum) * self.gain;
            }
            std::mem::swap(from, to);
            rest = after;
        }
        y.copy_from_slice(from);
    }
}

/// One forward pass of as many networks of one shape as there are lanes: the same bits in each lane as
/// [`Mlp::predict`] gives. `genes`: as [`Mlp::new`] takes them, a lane for each network; `values`: the
/// inputs, and the outputs afterwards; `spare`: a buffer.
///
/// # Panics
/// Numbers that do not fit `widths`.
#[inline(always)]
pub fn predict_lanes<S: Simd>(
    widths: &[usize],
    genes: &[Lanes<S>],
    activation: Activation,
    gain: f32,
    values: &mut Vec<Lanes<S>>,
    spare: &mut Vec<Lanes<S>>,
) {
    let mut rest = genes;
    for pair in widths.windows(2) {
        assert_eq!(values.len(), pair[0], "numbers in");
        let (layer, after) = rest.split_at((pair[0] + 1) * pair[1]);
        spare.clear();
        // Plain loops: closures handed to the standard library are compiled for any machine.
        for neuron in layer.chunks_exact(pair[0] + 1) {
            let mut sum = neuron[pair[0]];
            for (weight, input) in neuron.iter().zip(values.iter()) {
                sum += *weight * *input;
            }
            spare.push(activation.of_lanes(sum) * gain);
        }
        std::mem::swap(values, spare);
        rest = after;
    }
}

impl Weights for Mlp {
    const KIND: &'static str = "mlp";
    const ACTIVATIONS: &'static [&'static str] = &["logistic", "tanh", "cheap_tanh"];

    fn inputs(&self) -> usize {
        self.widths[0]
    }

    fn outputs(&self) -> usize {
        self.widths[self.widths.len() - 1]
    }

    fn activation(&self) -> &'static str {
        self.activation.name()
    }

    fn names(layers: usize) -> Vec<String> {
        layer_names(layers).chain(["gain".to_owned()]).collect()
    }

    fn tensors(&self) -> Vec<Tensor> {
        let mut tensors = Vec::new();
        let mut rest = &self.genome[..];
        for (index, pair) in self.widths.windows(2).enumerate() {
            let (inputs, outputs) = (pair[0], pair[1]);
            let (layer, after) = rest.split_at((inputs + 1) * outputs);
            let neurons = layer.chunks_exact(inputs + 1);
            let tensor = |part: &str, shape: Vec<usize>, values: Vec<f32>| {
                let name = format!("layers.{index}.{part}");
                Tensor { name, shape, values, may_be_half: true }
            };
            let weights = neurons.clone().flat_map(|n| &n[..inputs]).copied().collect();
            tensors.push(tensor("weight", vec![outputs, inputs], weights));
            tensors.push(tensor("bias", vec![outputs], neurons.map(|n| n[inputs]).collect()));
            rest = after;
        }
        let (name, values) = ("gain".into(), vec![self.gain]);
        tensors.push(Tensor { name, shape: vec![1], values, may_be_half: false });
        tensors
    }

    fn read(tensors: &Tensors<'_>, activation: &str) -> Result<Self, BundleError> {
        let (mut widths, mut genome) = (Vec::new(), Vec::new());
        for layer in 0..tensors.layers() {
            let name = format!("layers.{layer}.weight");
            let (shape, weights) = tensors.floats(&name)?;
            let (_, biases) = tensors.floats(&format!("layers.{layer}.bias"))?;
            let [outputs, inputs] = shape[..] else {
                let (expected, found) = ("a shape of outputs × inputs", format!("{shape:?}"));
                return Err(BundleError::Tensor { tensor: name, expected, found });
            };
            match widths.last() {
                None => widths.push(inputs),
                Some(&gets) if gets != inputs => {
                    return Err(NetworkError::Chain { layer, takes: inputs, gets }.into());
                }
                Some(_) => {}
            }
            if inputs == 0 || outputs == 0 {
                return Err(NetworkError::Width { layer, inputs, outputs }.into());
            }
            check(&format!("layers.{layer}.bias"), &biases, outputs)?;
            widths.push(outputs);
            for (weights, bias) in weights.chunks_exact(inputs).zip(biases) {
                genome.extend_from_slice(weights);
                genome.push(bias);
            }
        }
        let (_, gain) = tensors.floats("gain")?;
        check("gain", &gain, 1)?;
        let found = Activation::ALL.into_iter().find(|one| one.name() == activation);
        Ok(Mlp::new(&widths, &genome, found.expect("a checked header"), gain[0])?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::tests::numbers;
    use crate::{BundleOf, FORMAT_VERSION, Header, LayoutTable, Precision};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    const WIDTHS: [usize; 4] = [9, 10, 5, 8];

    fn mlp(activation: Activation) -> Mlp {
        Mlp::new(&WIDTHS, &numbers(Mlp::genes(&WIDTHS), 1), activation, 3.0).unwrap()
    }

    fn bundle(activation: Activation) -> BundleOf<Mlp> {
        let layout = LayoutTable {
            name: "test".into(),
            hash: "0".into(),
            inputs: vec![("a".into(), 9)],
            outputs: vec![("b".into(), 8)],
        };
        let header = Header {
            format: FORMAT_VERSION,
            kind: "mlp".into(),
            activation: activation.name().into(),
            fps: 60.0,
            layout,
            licence: String::new(),
            provenance: BTreeMap::new(),
            parts: BTreeMap::new(),
        };
        BundleOf::new(header, mlp(activation)).unwrap()
    }

    #[test]
    fn agrees_with_the_definition_in_f64() {
        for activation in Activation::ALL {
            let mlp = mlp(activation);
            let x = numbers(9, 2);
            let mut h: Vec<f64> = x.iter().map(|&v| f64::from(v)).collect();
            let mut genes = mlp.genome().iter().map(|&v| f64::from(v));
            for pair in WIDTHS.windows(2) {
                let neuron = |_| {
                    let sum: f64 = h.iter().map(|v| v * genes.next().unwrap()).sum();
                    let a = sum + genes.next().unwrap();
                    3.0 * match activation {
                        Activation::Logistic => 1.0 / (1.0 + (-a).exp()),
                        Activation::Tanh => a.tanh(),
                        Activation::CheapTanh => {
                            (a * (27.0 + a * a) / (27.0 + 9.0 * a * a)).clamp(-1.0, 1.0)
                        }
                    }
                };
                h = (0..pair[1]).map(neuron).collect();
            }
            let mut y = vec![0.0; 8];
            mlp.predict(&x, &mut y, &mut mlp.scratch());
            for (got, expected) in y.iter().zip(h) {
                assert!((f64::from(*got) - expected).abs() < 1e-5, "{activation:?}");
            }
        }
    }

    #[test]
    fn lanes_give_the_same_bits() {
        struct Pass<'a>(&'a Mlp, &'a [f32]);
        impl ambulo_lanes::Job for Pass<'_> {
            type Output = Vec<u32>;
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> Vec<u32> {
                let Self(mlp, x) = self;
                let lanes = |values: &[f32]| -> Vec<_> {
                    values.iter().map(|&v| Lanes::splat(simd, v)).collect()
                };
                let (genes, mut values) = (lanes(mlp.genome()), lanes(x));
                let (activation, gain) = (mlp.activation(), mlp.gain());
                predict_lanes(mlp.widths(), &genes, activation, gain, &mut values, &mut Vec::new()); // fmt: skip
                values.iter().map(|value| value.lane(Lanes::<S>::WIDTH - 1).to_bits()).collect()
            }
        }
        for activation in Activation::ALL {
            let (mlp, x) = (mlp(activation), numbers(9, 2));
            let mut y = vec![0.0; 8];
            mlp.predict(&x, &mut y, &mut mlp.scratch());
            let expected: Vec<u32> = y.iter().map(|value| value.to_bits()).collect();
            for width in ambulo_lanes::Width::available() {
                assert_eq!(width.run(Pass(&mlp, &x)), expected, "{activation:?} {width:?}");
            }
        }
    }

    #[test]
    fn cheap_tanh_is_near_tanh() {
        assert_eq!([3.0, 40.0, 3e38].map(|a| Activation::CheapTanh.of(a)), [1.0; 3]);
        assert_eq!([-3.0, -40.0, -3e38].map(|a| Activation::CheapTanh.of(a)), [-1.0; 3]);
        for i in -600..600 {
            let a = i as f32 / 100.0;
            let off = Activation::CheapTanh.of(a) - Activation::Tanh.of(a);
            assert!(off.abs() < 0.024, "{a}: {off}");
        }
    }

    #[test]
    fn a_bundle_of_it_survives_as_bytes_and_is_not_taken_for_another() {
        for activation in Activation::ALL {
            let bundle = bundle(activation);
            let bytes = bundle.to_bytes(Precision::Single).unwrap();
            let back = BundleOf::<Mlp>::from_bytes(&bytes).unwrap();
            assert_eq!(back, bundle);
            assert_eq!(back.to_bytes(Precision::Single).unwrap(), bytes);
            let pfnn = crate::Bundle::from_bytes(&bytes).unwrap_err().to_string();
            assert_eq!(pfnn, "kind 'mlp' is not known; expected 'pfnn'");
        }
        let mut wrong = bundle(Activation::Tanh).header().clone();
        wrong.activation = "logistic".into();
        assert!(BundleOf::new(wrong, mlp(Activation::Tanh)).is_err());
    }

    #[test]
    fn refuses_by_name() {
        let short = Mlp::new(&[2, 3], &[0.0; 8], Activation::Tanh, 1.0).unwrap_err();
        assert_eq!(short.to_string(), "'genome': expected 9 numbers, got 8");
        let mut genome = [0.0; 9];
        genome[4] = f32::INFINITY;
        assert!(matches!(
            Mlp::new(&[2, 3], &genome, Activation::Tanh, 1.0),
            Err(NetworkError::NotFinite { index: 4, .. })
        ));
        assert!(matches!(Mlp::new(&[2], &[], Activation::Tanh, 1.0), Err(NetworkError::Empty)));
        let zero = Mlp::new(&[2, 0, 3], &[0.0; 3], Activation::Tanh, 1.0);
        assert!(matches!(zero, Err(NetworkError::Width { layer: 0, .. })));
    }

    proptest! {
        #[test]
        fn never_panics_on_nearly_right_bytes(at in 0usize..3000, byte in any::<u8>()) {
            let mut bytes = bundle(Activation::Tanh).to_bytes(Precision::Single).unwrap();
            let at = at % bytes.len();
            bytes[at] = byte;
            if let Ok(read) = BundleOf::<Mlp>::from_bytes(&bytes) {
                prop_assert!(read.network().widths() == WIDTHS);
            }
        }
    }
}
