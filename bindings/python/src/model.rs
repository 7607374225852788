//! Bundles and their networks.

use std::sync::Arc;

use ambulo_features::{Block, Layout, Output};
use ambulo_net::{Bundle, CONTROL_POINTS, Layer, Network, Normalisation, Precision, spline_shares};
use numpy::ndarray::{Array2, Array3};
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::value_error;

/// A network and its header; immutable.
#[pyclass(frozen, module = "ambulo")]
pub struct Model {
    pub bundle: Arc<Bundle>,
}

fn vector(values: PyReadonlyArray1<'_, f32>) -> Vec<f32> {
    values.as_array().to_vec()
}

#[pymethods]
impl Model {
    /// Reads a bundle's bytes.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let bundle = Bundle::from_bytes(bytes).map_err(value_error)?;
        Ok(Self { bundle: Arc::new(bundle) })
    }

    /// Builds a bundle from a header (JSON text) and arrays: a list of (4, outputs, inputs)
    /// weights and (4, outputs) biases, and the four normalisation vectors.
    #[staticmethod]
    fn build(
        header: &str,
        layers: Vec<(PyReadonlyArray3<'_, f32>, PyReadonlyArray2<'_, f32>)>,
        input_mean: PyReadonlyArray1<'_, f32>,
        input_std: PyReadonlyArray1<'_, f32>,
        output_mean: PyReadonlyArray1<'_, f32>,
        output_std: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<Self> {
        let header = serde_json::from_str(header).map_err(value_error)?;
        let mut checked = Vec::with_capacity(layers.len());
        for (index, (weights, biases)) in layers.iter().enumerate() {
            let &[points, outputs, inputs] = weights.shape() else { unreachable!("three axes") };
            if points != CONTROL_POINTS || biases.shape() != [CONTROL_POINTS, outputs] {
                return Err(PyValueError::new_err(format!(
                    "layer {index}: weights {:?} and biases {:?}, expected (4, outputs, inputs) and (4, outputs)",
                    weights.shape(),
                    biases.shape()
                )));
            }
            let weights: Vec<f32> = weights.as_array().iter().copied().collect();
            let biases: Vec<f32> = biases.as_array().iter().copied().collect();
            checked
                .push(Layer::new(index, inputs, outputs, &weights, &biases).map_err(value_error)?);
        }
        let normalisation = Normalisation {
            input_mean: vector(input_mean),
            input_std: vector(input_std),
            output_mean: vector(output_mean),
            output_std: vector(output_std),
        };
        let network = Network::new(checked, normalisation).map_err(value_error)?;
        let bundle = Bundle::new(header, network).map_err(value_error)?;
        Ok(Self { bundle: Arc::new(bundle) })
    }

    /// The bundle as a file's bytes, its layers in half precision if that is asked for.
    #[pyo3(signature = (half = false))]
    fn to_bytes<'py>(&self, py: Python<'py>, half: bool) -> PyResult<Bound<'py, PyBytes>> {
        let precision = if half { Precision::Half } else { Precision::Single };
        Ok(PyBytes::new(py, &self.bundle.to_bytes(precision).map_err(value_error)?))
    }

    /// Whether the layers were in half precision in the bytes that it was read from.
    #[getter]
    fn half(&self) -> bool {
        self.bundle.precision() == Precision::Half
    }

    /// The header as JSON text.
    fn header_json(&self) -> PyResult<String> {
        serde_json::to_string(self.bundle.header()).map_err(value_error)
    }

    /// Numbers in.
    #[getter]
    fn inputs(&self) -> usize {
        self.bundle.network().inputs()
    }

    /// Numbers out.
    #[getter]
    fn outputs(&self) -> usize {
        self.bundle.network().outputs()
    }

    /// Widths of the layers, first input to last output.
    #[getter]
    fn widths(&self) -> Vec<usize> {
        let layers = self.bundle.network().layers();
        std::iter::once(self.inputs()).chain(layers.iter().map(|layer| layer.outputs())).collect()
    }

    /// Control points of every layer: a list of (4, outputs, inputs) weights and (4, outputs)
    /// biases.
    #[allow(clippy::type_complexity)] // A list of pairs of arrays.
    fn layers<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let layers = self.bundle.network().layers().iter();
        layers
            .map(|layer| {
                let (inputs, outputs) = (layer.inputs(), layer.outputs());
                let weights = layer.weights().into_pyarray(py);
                let biases = layer.biases().into_pyarray(py);
                Ok((
                    weights.reshape([CONTROL_POINTS, outputs, inputs])?.into_any(),
                    biases.reshape([CONTROL_POINTS, outputs])?.into_any(),
                ))
            })
            .collect()
    }

    /// The normalisation vectors by name: input_mean, input_std, output_mean, output_std.
    fn normalisation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let n = self.bundle.network().normalisation();
        let dict = PyDict::new(py);
        dict.set_item("input_mean", n.input_mean.clone().into_pyarray(py))?;
        dict.set_item("input_std", n.input_std.clone().into_pyarray(py))?;
        dict.set_item("output_mean", n.output_mean.clone().into_pyarray(py))?;
        dict.set_item("output_std", n.output_std.clone().into_pyarray(py))?;
        Ok(dict)
    }

    /// (N, inputs) and (N,) radians to (N, outputs).
    fn predict<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray2<'py, f32>,
        phase: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let network = self.bundle.network();
        let (x, phase) = (x.as_array(), phase.as_array());
        if x.ncols() != network.inputs() {
            let message = format!("x has {} columns, expected {}", x.ncols(), network.inputs());
            return Err(PyValueError::new_err(message));
        }
        if x.nrows() != phase.len() {
            let message = format!("x has {} rows, phase {} numbers", x.nrows(), phase.len());
            return Err(PyValueError::new_err(message));
        }
        if let Some(at) = phase.iter().position(|p| !p.is_finite()) {
            let message = format!("phase[{at}] is {}, expected a finite number", phase[at]);
            return Err(PyValueError::new_err(message));
        }
        let y = py.detach(|| {
            let mut scratch = network.scratch();
            let mut y = Array2::zeros((x.nrows(), network.outputs()));
            let mut row_in = vec![0.0; network.inputs()];
            for (index, mut row) in y.rows_mut().into_iter().enumerate() {
                row_in.iter_mut().zip(x.row(index)).for_each(|(to, from)| *to = *from);
                let out = row.as_slice_mut().expect("rows of a new array are contiguous");
                network.predict(&row_in, phase[index], out, &mut scratch);
            }
            y
        });
        Ok(y.into_pyarray(py))
    }
}

/// A layout's tables: name, hash, fps, units_per_metre, rate_time (seconds that velocities count
/// in), yaw_sign (−1 where turning to the left is negative), inputs and outputs as (name, size) lists.
#[pyfunction]
pub fn layout<'py>(py: Python<'py>, name: &str, joints: usize) -> PyResult<Bound<'py, PyDict>> {
    let layout = Layout::named(name, joints).map_err(value_error)?;
    let table = |blocks: &[Block]| -> Vec<(&str, usize)> {
        blocks.iter().map(|block| (block.name, block.range.len())).collect()
    };
    let dict = PyDict::new(py);
    dict.set_item("name", layout.name())?;
    dict.set_item("hash", layout.hash())?;
    dict.set_item("fps", layout.fps())?;
    dict.set_item("units_per_metre", layout.units_per_metre())?;
    dict.set_item("rate_time", layout.rate_time())?;
    dict.set_item("yaw_sign", layout.yaw_sign())?;
    dict.set_item("inputs", table(layout.inputs()))?;
    dict.set_item("outputs", table(layout.outputs()))?;
    Ok(dict)
}

/// Output vectors (N, outputs) of a layout to (N, J, 4) rotations x, y, z, w from the root.
#[pyfunction]
pub fn joint_rotations<'py>(
    py: Python<'py>,
    name: &str,
    joints: usize,
    outputs: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let layout = Layout::named(name, joints).map_err(value_error)?;
    let rows = outputs.as_array();
    if rows.ncols() != layout.output_len() {
        let message =
            format!("outputs have {} columns, expected {}", rows.ncols(), layout.output_len());
        return Err(PyValueError::new_err(message));
    }
    let mut output = Output::zero(joints);
    let mut numbers = Vec::with_capacity(rows.nrows() * joints * 4);
    for row in rows.rows() {
        layout.decode_output(&row.to_vec(), &mut output);
        numbers.extend(output.joint_rotation.iter().flat_map(|rotation| rotation.to_array()));
    }
    let array = Array3::from_shape_vec((rows.nrows(), joints, 4), numbers);
    Ok(array.expect("four numbers a rotation").into_pyarray(py))
}

/// Phases in cycles to (N, 4) shares of the control points.
#[pyfunction]
pub fn phase_shares<'py>(py: Python<'py>, cycles: Vec<f64>) -> Bound<'py, PyArray2<f64>> {
    let shares = cycles.iter().flat_map(|&phase| spline_shares(phase)).collect();
    let shares = Array2::from_shape_vec((cycles.len(), CONTROL_POINTS), shares);
    shares.expect("four shares a phase").into_pyarray(py)
}
