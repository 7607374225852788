//! One file that holds a network and everything needed to use it rightly.
//!
//! A safetensors file. Tensors of a [`Network`]: `layers.N.weight` (4, outputs, inputs),
//! `layers.N.bias` (4, outputs), `input.mean`, `input.std`, `output.mean`, `output.std`; of an
//! [`Mlp`](crate::Mlp): `layers.N.weight` (outputs, inputs), `layers.N.bias` (outputs), `gain` (1).
//! Each is float32, or float16 to halve the file; in memory all are float32. Its metadata has one
//! entry, `ambulo`: the [`Header`] as JSON. One entry, because the order of several is not fixed and
//! the same bundle must always be the same bytes.

use std::collections::{BTreeMap, HashMap};

use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensorError, SafeTensors};
use serde::{Deserialize, Serialize};

use crate::{CONTROL_POINTS, Layer, Network, NetworkError, Normalisation};

/// The version this code writes, and the highest it reads.
pub const FORMAT_VERSION: u32 = 1;

const METADATA_KEY: &str = "ambulo";
const NORMALISATION: [&str; 4] = ["input.mean", "input.std", "output.mean", "output.std"];

/// How the weights and biases of a bundle are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// float32: nothing is lost.
    #[default]
    Single,
    /// float16, rounded to nearest: half the size, 11 significant bits. Means and deviations stay
    /// float32, since they carry the units.
    Half,
}

/// What the two vectors are made of: blocks by name and size, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayoutTable {
    /// Name of the family of layouts, `holden` for instance.
    pub name: String,
    /// Fingerprint of the tables and of the meaning of their numbers.
    pub hash: String,
    /// Blocks of the input vector.
    pub inputs: Vec<(String, usize)>,
    /// Blocks of the output vector.
    pub outputs: Vec<(String, usize)>,
}

/// Everything in a bundle but its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the file format.
    pub format: u32,
    /// Architecture: `pfnn`, or `mlp`.
    pub kind: String,
    /// Activation: `elu` of a `pfnn`; `logistic`, `tanh` or `cheap_tanh` of an `mlp`.
    pub activation: String,
    /// Steps a second that the network was trained for.
    pub fps: f64,
    /// Layout of the vectors.
    pub layout: LayoutTable,
    /// Licence of the data behind the weights, in words; it stays with the model.
    pub licence: String,
    /// Where the model comes from: source, tool, settings; free text by key.
    pub provenance: BTreeMap<String, String>,
    /// What other parts of a runtime store beside the network, by part (`skeleton`).
    pub parts: BTreeMap<String, serde_json::Value>,
}

/// Why bytes are not a bundle.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum BundleError {
    #[error("not a safetensors file: {0}")]
    Container(#[from] SafeTensorError),
    #[error("a safetensors file, but not an Ambulo bundle: its metadata has no '{METADATA_KEY}'")]
    NotABundle,
    #[error("the bundle's header is broken: {0}")]
    Header(serde_json::Error),
    #[error(
        "the bundle is of format {found}, this version reads up to {FORMAT_VERSION}: update Ambulo"
    )]
    Version { found: u32 },
    #[error("{what} '{found}' is not known; expected '{expected}'")]
    Unknown { what: &'static str, found: String, expected: String },
    #[error("fps must be positive and finite, not {0}")]
    Fps(f64),
    #[error("tensor '{0}' is missing")]
    Missing(String),
    #[error("tensor '{0}' is not part of this format")]
    Extra(String),
    #[error("tensor '{tensor}': expected {expected}, got {found}")]
    Tensor { tensor: String, expected: &'static str, found: String },
    #[error(
        "tensor '{tensor}': number {index} is {value}, beyond half precision (65504): write it in \
         single precision"
    )]
    BeyondHalf { tensor: String, index: usize, value: f32 },
    #[error("the layout's {side} blocks sum to {blocks}, the network has {network} {side}")]
    Layout { side: &'static str, blocks: usize, network: usize },
    #[error(transparent)]
    Network(#[from] NetworkError),
}

/// Numbers that a bundle can hold: an architecture.
pub trait Weights: Sized {
    /// The header's `kind`.
    const KIND: &'static str;
    /// What the header's `activation` may be.
    const ACTIVATIONS: &'static [&'static str];

    /// Numbers in.
    fn inputs(&self) -> usize;
    /// Numbers out.
    fn outputs(&self) -> usize;
    /// The header's `activation`.
    fn activation(&self) -> &'static str;
    /// Names of all tensors of so many layers.
    fn names(layers: usize) -> Vec<String>;
    /// Its tensors, in the order of the file.
    fn tensors(&self) -> Vec<Tensor>;
    /// From a file's tensors.
    ///
    /// # Errors
    /// Tensors that are missing or not as they must be.
    fn read(tensors: &Tensors<'_>, activation: &str) -> Result<Self, BundleError>;
}

/// A tensor to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Its name in the file.
    pub name: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// Its numbers, row-major.
    pub values: Vec<f32>,
    /// Whether it may be rounded to half precision.
    pub may_be_half: bool,
}

/// The tensors of a file.
pub struct Tensors<'bytes> {
    tensors: SafeTensors<'bytes>,
    layers: usize,
}

impl Tensors<'_> {
    /// How many layers there are, by their names.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Shape and numbers of a tensor.
    ///
    /// # Errors
    /// It is missing, or not of floats.
    pub fn floats(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>), BundleError> {
        let tensor = self.tensors.tensor(name).map_err(|_| BundleError::Missing(name.into()))?;
        let values = match tensor.dtype() {
            Dtype::F32 => numbers(tensor.data(), f32::from_le_bytes),
            Dtype::F16 => numbers(tensor.data(), |word| f16::from_le_bytes(word).to_f32()),
            other => {
                let (tensor, found) = (name.into(), format!("{other:?}"));
                return Err(BundleError::Tensor { tensor, expected: "float32 or float16", found });
            }
        };
        Ok((tensor.shape().to_vec(), values))
    }
}

/// A network and its header.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleOf<N> {
    header: Header,
    network: N,
    precision: Precision,
}

/// A phase-functioned network and its header.
pub type Bundle = BundleOf<Network>;

impl<N: Weights> BundleOf<N> {
    /// Checks that header and network belong together.
    ///
    /// # Errors
    /// An unknown version, kind or activation, a frame rate that is not positive, blocks that do
    /// not sum to the network's widths.
    pub fn new(header: Header, network: N) -> Result<Self, BundleError> {
        check_header::<N>(&header)?;
        if header.activation != network.activation() {
            let expected = network.activation().to_owned();
            return Err(unknown("activation", &header.activation, expected));
        }
        let sides = [
            ("inputs", &header.layout.inputs, network.inputs()),
            ("outputs", &header.layout.outputs, network.outputs()),
        ];
        for (side, blocks, network) in sides {
            let blocks = blocks.iter().fold(0usize, |sum, (_, size)| sum.saturating_add(*size));
            if blocks != network {
                return Err(BundleError::Layout { side, blocks, network });
            }
        }
        Ok(Self { header, network, precision: Precision::Single })
    }

    /// Everything but the numbers.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The network.
    pub fn network(&self) -> &N {
        &self.network
    }

    /// That in which the bytes it was read from hold its layers: half only if all of them are.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Reads a bundle; the bytes may come from anywhere.
    ///
    /// # Errors
    /// Anything that is not a complete, consistent bundle of a known version, with what is wrong.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BundleError> {
        let header = Header::from_bytes(bytes)?;
        check_header::<N>(&header)?;
        let tensors = SafeTensors::deserialize(bytes)?;
        let all = 0..;
        let layers =
            all.take_while(|i| tensors.tensor(&format!("layers.{i}.weight")).is_ok()).count();
        let known = N::names(layers);
        let extra = |name: &&str| !known.iter().any(|known| known == name);
        if let Some(extra) = tensors.names().into_iter().find(extra) {
            return Err(BundleError::Extra(extra.into()));
        }
        let tensors = Tensors { tensors, layers };
        let mut bundle = Self::new(header.clone(), N::read(&tensors, &header.activation)?)?;
        let layers = tensors.tensors.iter().filter(|(name, _)| name.starts_with("layers."));
        if layers.into_iter().all(|(_, tensor)| tensor.dtype() == Dtype::F16) {
            bundle.precision = Precision::Half;
        }
        Ok(bundle)
    }

    /// The file's bytes: the same bundle in the same precision always gives the same.
    ///
    /// # Errors
    /// A weight or bias too large for half precision.
    pub fn to_bytes(&self, precision: Precision) -> Result<Vec<u8>, BundleError> {
        let json = serde_json::to_string(&self.header).map_err(BundleError::Header)?;
        let mut tensors = Vec::new();
        for Tensor { name, shape, values, may_be_half } in self.network.tensors() {
            let precision = if may_be_half { precision } else { Precision::Single };
            tensors.push(Stored::new(name, shape, &values, precision)?);
        }
        let views = tensors
            .iter()
            .map(|t| Ok((t.name.as_str(), TensorView::new(t.dtype, t.shape.clone(), &t.bytes)?)));
        let views = views.collect::<Result<Vec<_>, SafeTensorError>>()?;
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), json)]);
        Ok(safetensors::serialize(views, Some(metadata))?)
    }
}

impl Header {
    /// Only the header of a bundle of any kind.
    ///
    /// # Errors
    /// Bytes that are no bundle, a version that is not known, a broken header.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BundleError> {
        let (_, metadata) = SafeTensors::read_metadata(bytes)?;
        let entry = metadata.metadata().as_ref().and_then(|m| m.get(METADATA_KEY));
        let json = entry.ok_or(BundleError::NotABundle)?;
        // The version first: a later header may have fields that this one does not know.
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let version: Version = serde_json::from_str(json).map_err(BundleError::Header)?;
        if version.format > FORMAT_VERSION {
            return Err(BundleError::Version { found: version.format });
        }
        serde_json::from_str(json).map_err(BundleError::Header)
    }
}

impl Weights for Network {
    const KIND: &'static str = "pfnn";
    const ACTIVATIONS: &'static [&'static str] = &["elu"];

    fn inputs(&self) -> usize {
        self.inputs()
    }

    fn outputs(&self) -> usize {
        self.outputs()
    }

    fn activation(&self) -> &'static str {
        "elu"
    }

    fn names(layers: usize) -> Vec<String> {
        layer_names(layers).chain(NORMALISATION.map(String::from)).collect()
    }

    fn tensors(&self) -> Vec<Tensor> {
        let mut tensors = Vec::new();
        for (index, layer) in self.layers().iter().enumerate() {
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            tensors.push(Tensor {
                name: format!("layers.{index}.weight"),
                shape: vec![CONTROL_POINTS, outputs, inputs],
                values: layer.weights(),
                may_be_half: true,
            });
            tensors.push(Tensor {
                name: format!("layers.{index}.bias"),
                shape: vec![CONTROL_POINTS, outputs],
                values: layer.biases(),
                may_be_half: true,
            });
        }
        let n = self.normalisation();
        let values = [&n.input_mean, &n.input_std, &n.output_mean, &n.output_std];
        tensors.extend(NORMALISATION.into_iter().zip(values).map(|(name, values)| Tensor {
            name: name.into(),
            shape: vec![values.len()],
            values: values.clone(),
            may_be_half: false,
        }));
        tensors
    }

    fn read(tensors: &Tensors<'_>, _: &str) -> Result<Self, BundleError> {
        let mut layers = Vec::with_capacity(tensors.layers());
        for index in 0..tensors.layers() {
            let (shape, weights) = tensors.floats(&format!("layers.{index}.weight"))?;
            let (_, biases) = tensors.floats(&format!("layers.{index}.bias"))?;
            let [CONTROL_POINTS, outputs, inputs] = shape[..] else {
                return Err(BundleError::Tensor {
                    tensor: format!("layers.{index}.weight"),
                    expected: "a shape of 4 × outputs × inputs",
                    found: format!("{shape:?}"),
                });
            };
            layers.push(Layer::new(index, inputs, outputs, &weights, &biases)?);
        }
        let [input_mean, input_std, output_mean, output_std] =
            NORMALISATION.map(|name| tensors.floats(name).map(|(_, values)| values));
        let (input_mean, input_std) = (input_mean?, input_std?);
        let (output_mean, output_std) = (output_mean?, output_std?);
        let normalisation = Normalisation { input_mean, input_std, output_mean, output_std };
        Ok(Network::new(layers, normalisation)?)
    }
}

/// Names of the tensors of so many layers.
pub(crate) fn layer_names(layers: usize) -> impl Iterator<Item = String> {
    (0..layers).flat_map(|i| ["weight", "bias"].map(|part| format!("layers.{i}.{part}")))
}

fn unknown(what: &'static str, found: &str, expected: String) -> BundleError {
    BundleError::Unknown { what, found: found.to_owned(), expected }
}

/// A tensor as the file holds it.
struct Stored {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Stored {
    fn new(
        name: String,
        shape: Vec<usize>,
        values: &[f32],
        precision: Precision,
    ) -> Result<Self, BundleError> {
        let (dtype, bytes) = match precision {
            Precision::Single => {
                (Dtype::F32, values.iter().flat_map(|v| v.to_le_bytes()).collect())
            }
            Precision::Half => {
                let halves: Vec<_> = values.iter().map(|&v| f16::from_f32(v)).collect();
                if let Some(index) = halves.iter().position(|half| !half.is_finite()) {
                    let value = values[index];
                    return Err(BundleError::BeyondHalf { tensor: name, index, value });
                }
                (Dtype::F16, halves.iter().flat_map(|half| half.to_le_bytes()).collect())
            }
        };
        Ok(Self { name, dtype, shape, bytes })
    }
}

fn check_header<N: Weights>(header: &Header) -> Result<(), BundleError> {
    if header.format > FORMAT_VERSION || header.format == 0 {
        return Err(BundleError::Version { found: header.format });
    }
    if header.kind != N::KIND {
        return Err(unknown("kind", &header.kind, N::KIND.into()));
    }
    if !N::ACTIVATIONS.contains(&header.activation.as_str()) {
        return Err(unknown("activation", &header.activation, N::ACTIVATIONS.join("' or '")));
    }
    if !(header.fps > 0.0 && header.fps.is_finite()) {
        return Err(BundleError::Fps(header.fps));
    }
    Ok(())
}

fn numbers<const N: usize>(bytes: &[u8], read: impl Fn([u8; N]) -> f32) -> Vec<f32> {
    bytes.chunks_exact(N).map(|word| read(word.try_into().expect("N bytes"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::tests::{network, numbers};
    use proptest::prelude::*;

    fn header(inputs: usize, outputs: usize) -> Header {
        Header {
            format: FORMAT_VERSION,
            kind: "pfnn".into(),
            activation: "elu".into(),
            fps: 60.0,
            layout: LayoutTable {
                name: "test".into(),
                hash: "0".into(),
                inputs: vec![("a".into(), inputs - 1), ("b".into(), 1)],
                outputs: vec![("c".into(), outputs)],
            },
            licence: "none".into(),
            provenance: BTreeMap::from([("source".into(), "a test".into())]),
            parts: BTreeMap::from([("skeleton".into(), serde_json::json!([1, 2]))]),
        }
    }

    fn bundle() -> Bundle {
        Bundle::new(header(19, 11), network(&[19, 8, 8, 11])).unwrap()
    }

    fn with_header(change: impl FnOnce(&mut Header)) -> Vec<u8> {
        let mut bundle = bundle();
        change(&mut bundle.header);
        bundle.to_bytes(Precision::Single).unwrap()
    }

    #[test]
    fn a_round_trip_changes_nothing() {
        let bundle = bundle();
        let bytes = bundle.to_bytes(Precision::Single).unwrap();
        assert_eq!(bytes, bundle.to_bytes(Precision::Single).unwrap(), "the same bytes every time");
        let back = Bundle::from_bytes(&bytes).unwrap();
        assert_eq!(back, bundle);
        assert_eq!(back.to_bytes(Precision::Single).unwrap(), bytes);
        let (x, mut a, mut b) = (numbers(19, 3), vec![0.0; 11], vec![0.0; 11]);
        bundle.network().predict(&x, 0.3, &mut a, &mut bundle.network().scratch());
        back.network().predict(&x, 0.3, &mut b, &mut back.network().scratch());
        assert_eq!(a, b);
    }

    #[test]
    fn half_precision_halves_the_file_and_rounds_once() {
        let bundle = Bundle::new(header(19, 11), network(&[19, 64, 64, 11])).unwrap();
        let single = bundle.to_bytes(Precision::Single).unwrap();
        let half = bundle.to_bytes(Precision::Half).unwrap();
        assert!(half.len() < 6 * single.len() / 10, "{} of {}", half.len(), single.len());
        let back = Bundle::from_bytes(&half).unwrap();
        assert_eq!([bundle.precision(), back.precision()], [Precision::Single, Precision::Half]);
        assert_eq!(back.header(), bundle.header());
        assert_eq!(back.network().normalisation(), bundle.network().normalisation());
        for (a, b) in bundle.network().layers().iter().zip(back.network().layers()) {
            for (a, b) in a.weights().iter().zip(b.weights()) {
                // Half a unit in the last of 11 places; below 2⁻¹⁴ steps are even.
                assert!((a - b).abs() <= a.abs().max(6.2e-5) * 0.000_489, "{a} became {b}");
            }
        }
        assert_eq!(back.to_bytes(Precision::Half).unwrap(), half, "rounded already");
        let again = Bundle::from_bytes(&back.to_bytes(Precision::Single).unwrap()).unwrap();
        assert_eq!(again.network(), back.network(), "single precision holds every half");
        let (x, mut a, mut b) = (numbers(19, 3), vec![0.0; 11], vec![0.0; 11]);
        bundle.network().predict(&x, 0.3, &mut a, &mut bundle.network().scratch());
        back.network().predict(&x, 0.3, &mut b, &mut back.network().scratch());
        for (i, std) in bundle.network().normalisation().output_std.iter().enumerate() {
            assert!((a[i] - b[i]).abs() < 0.02 * std && a != b, "{} {}", a[i], b[i]);
        }
    }

    #[test]
    fn weights_beyond_half_precision_are_refused_by_name() {
        let small = network(&[3, 2]);
        let layer = |bias: f32| Layer::new(0, 3, 2, &[0.5; 24], &[bias; 8]).unwrap();
        let bundle = |bias: f32| {
            let network = Network::new(vec![layer(bias)], small.normalisation().clone()).unwrap();
            Bundle::new(header(3, 2), network).unwrap()
        };
        // The largest half is 65504; up to 65520 numbers are rounded to it.
        assert!(bundle(65_519.0).to_bytes(Precision::Half).is_ok());
        let error = bundle(-65_520.0).to_bytes(Precision::Half).unwrap_err().to_string();
        assert_eq!(
            error,
            "tensor 'layers.0.bias': number 0 is -65520, beyond half precision (65504): write it \
             in single precision"
        );
        assert!(bundle(-65_520.0).to_bytes(Precision::Single).is_ok());
    }

    /// Precision is each tensor's own: another tool may round what it likes.
    #[test]
    fn any_tensor_may_be_half() {
        let bundle = bundle();
        let single = bundle.to_bytes(Precision::Single).unwrap();
        let (_, metadata) = SafeTensors::read_metadata(&single).unwrap();
        let tensors = SafeTensors::deserialize(&single).unwrap();
        let rewritten = |only: &str, dtype: Dtype| {
            let stored: Vec<_> = tensors
                .iter()
                .map(|(name, tensor)| {
                    let values = super::numbers(tensor.data(), f32::from_le_bytes);
                    let half = if name == only { Precision::Half } else { Precision::Single };
                    let shape = tensor.shape().to_vec();
                    let mut stored = Stored::new(name.into(), shape, &values, half).unwrap();
                    if name == only && dtype != Dtype::F16 {
                        stored.dtype = dtype;
                    }
                    stored
                })
                .collect();
            let views = stored
                .iter()
                .map(|t| (&t.name, TensorView::new(t.dtype, t.shape.clone(), &t.bytes).unwrap()));
            let bytes = safetensors::serialize(views, metadata.metadata().clone()).unwrap();
            Bundle::from_bytes(&bytes)
        };
        let mixed = rewritten("layers.1.weight", Dtype::F16).unwrap();
        assert_eq!(mixed.precision(), Precision::Single);
        assert_eq!(mixed.network().layers()[0], bundle.network().layers()[0]);
        assert_ne!(mixed.network().layers()[1], bundle.network().layers()[1]);
        rewritten("output.std", Dtype::F16).unwrap();
        let other = rewritten("layers.1.weight", Dtype::BF16).unwrap_err().to_string();
        assert_eq!(other, "tensor 'layers.1.weight': expected float32 or float16, got BF16");
    }

    #[test]
    fn refuses_and_says_why() {
        let message = |bytes: &[u8]| Bundle::from_bytes(bytes).unwrap_err().to_string();
        let later = with_header(|h| h.format = 2);
        assert_eq!(
            message(&later),
            "the bundle is of format 2, this version reads up to 1: update Ambulo"
        );
        assert!(message(&with_header(|h| h.kind = "mann".into())).contains("kind 'mann'"));
        assert!(message(&with_header(|h| h.activation = "relu".into())).contains("'relu'"));
        assert!(message(&with_header(|h| h.fps = -1.0)).contains("fps"));
        let layout = message(&with_header(|h| h.layout.inputs[0].1 = 3));
        assert_eq!(layout, "the layout's inputs blocks sum to 4, the network has 19 inputs");
        let foreign = safetensors::serialize(Vec::<(&str, TensorView)>::new(), None).unwrap();
        assert!(message(&foreign).contains("not an Ambulo bundle"));
        assert!(message(b"").contains("not a safetensors file"));
        let mut cut = bundle().to_bytes(Precision::Single).unwrap();
        cut.pop();
        assert!(message(&cut).contains("not a safetensors file"));
        let mut nan = bundle().to_bytes(Precision::Single).unwrap();
        let end = nan.len();
        nan[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(message(&nan).contains("expected a finite number"), "{}", message(&nan));
    }

    #[test]
    fn refuses_tensors_that_are_missing_or_too_many() {
        let bytes = bundle().to_bytes(Precision::Single).unwrap();
        let renamed = |from: &str, to: &str| {
            assert_eq!(from.len(), to.len());
            let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            let mut bytes = bytes.clone();
            bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
            Bundle::from_bytes(&bytes).unwrap_err().to_string()
        };
        assert_eq!(
            renamed("\"input.mean\"", "\"input.meen\""),
            "tensor 'input.meen' is not part of this format"
        );
        assert_eq!(
            renamed("\"layers.0.bias\"", "\"layers.9.bias\""),
            "tensor 'layers.9.bias' is not part of this format"
        );
    }

    proptest! {
        #[test]
        fn never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = Bundle::from_bytes(&bytes);
        }

        #[test]
        fn never_panics_on_nearly_right_bytes(
            at in 0usize..3000, byte in any::<u8>(), half in any::<bool>(),
        ) {
            let precision = if half { Precision::Half } else { Precision::Single };
            let mut bytes = bundle().to_bytes(precision).unwrap();
            let at = at % bytes.len();
            bytes[at] = byte;
            if let Ok(read) = Bundle::from_bytes(&bytes) {
                prop_assert!(read.network().layers().len() == 3);
            }
        }
    }
}
