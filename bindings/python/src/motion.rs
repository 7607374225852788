//! Motion files and clips.

use std::path::{Path, PathBuf};

use ambulo_formats::bvh::{Dialect, WriteOptions};
use ambulo_formats::detect::{Detected, Guess, PositionsFit, detect};
use ambulo_formats::files::{FileError, read_path, write_path};
use ambulo_formats::{Note, Positions, ReadOptions};
use ambulo_rig as rig;
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Axes, Handedness, Joint, Mirror, MirrorError, Skeleton};
use numpy::ndarray::{Array2, Array3};
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{file_error, value_error};

/// A skeleton's motion; immutable.
#[pyclass(frozen, module = "ambulo")]
pub struct Clip {
    pub clip: rig::Clip,
    /// How the file that it comes from writes it.
    dialect: Option<Dialect>,
}

/// One row a point.
fn points(points: impl ExactSizeIterator<Item = DVec3>) -> Array2<f64> {
    let shape = (points.len(), 3);
    let numbers = points.flat_map(|point| point.to_array()).collect();
    Array2::from_shape_vec(shape, numbers).expect("three numbers a point")
}

fn shape_error(what: &str, shape: &[usize], expected: &str) -> PyErr {
    PyValueError::new_err(format!("{what} has the shape {shape:?}, expected {expected}"))
}

impl Clip {
    /// The same motion changed, to be written as its file was.
    fn with(&self, clip: rig::Clip) -> Self {
        Self { clip, dialect: self.dialect.clone() }
    }

    fn local(&self, frame: usize) -> Vec<DVec3> {
        let joints = self.clip.skeleton().joints().iter();
        let mut local: Vec<_> = joints.map(|joint| joint.offset).collect();
        let moved = self.clip.moving().iter().zip(self.clip.translations(frame));
        moved.for_each(|(&joint, &place)| local[joint] = place);
        local
    }

    fn mirror(&self, method: &str, lateral: DVec3) -> Result<Mirror, MirrorError> {
        let by_geometry = || Mirror::by_geometry(&self.clip, lateral);
        match method {
            "geometry" => by_geometry(),
            "name" => Mirror::by_name(&self.clip, lateral),
            _ => Mirror::by_name(&self.clip, lateral).or_else(|error| match error {
                MirrorError::NoNames => by_geometry(),
                _ => Err(error),
            }),
        }
    }
}

#[pymethods]
impl Clip {
    /// Builds a clip: J names; parents, -1 for the root alone; (J, 3) offsets; (F, J, 4) local
    /// rotations as (x, y, z, w); and, where the root moves, (F, 3) places of it.
    #[staticmethod]
    #[pyo3(signature = (*, names, parents, offsets, fps, rotations, root = None))]
    fn from_arrays(
        py: Python<'_>,
        names: Vec<String>,
        parents: Vec<i64>,
        offsets: PyReadonlyArray2<'_, f64>,
        fps: f64,
        rotations: PyReadonlyArray3<'_, f64>,
        root: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        let joints = names.len();
        if parents.len() != joints || offsets.shape() != [joints, 3] {
            let message = format!(
                "{joints} names, {} parents and offsets of the shape {:?} do not fit",
                parents.len(),
                offsets.shape()
            );
            return Err(PyValueError::new_err(message));
        }
        let &[frames, ..] = rotations.shape() else { unreachable!("three axes") };
        if rotations.shape() != [frames, joints, 4] {
            let expected = format!("(F, {joints}, 4)");
            return Err(shape_error("rotations", rotations.shape(), &expected));
        }
        if let Some(root) = &root
            && root.shape() != [frames, 3]
        {
            return Err(shape_error("root", root.shape(), &format!("({frames}, 3)")));
        }
        let offsets: Vec<_> =
            offsets.as_array().rows().into_iter().map(|o| DVec3::new(o[0], o[1], o[2])).collect();
        let joint = |((name, parent), offset): ((String, i64), DVec3)| Joint {
            name,
            // What is neither a joint nor -1 is refused by the skeleton.
            parent: (parent != -1).then(|| usize::try_from(parent).unwrap_or(usize::MAX)),
            offset,
            tips: vec![],
        };
        let list = names.into_iter().zip(parents).zip(offsets).map(joint).collect();
        let skeleton = Skeleton::new(list).map_err(value_error)?;
        let (rotations, root) = (rotations.as_array(), root.as_ref().map(|root| root.as_array()));
        let clip = py.detach(|| {
            let quat =
                |q: numpy::ndarray::ArrayView1<'_, f64>| DQuat::from_xyzw(q[0], q[1], q[2], q[3]);
            let rotations = rotations.lanes(numpy::ndarray::Axis(2)).into_iter().map(quat);
            let rotations = rotations.collect();
            let moving = if root.is_some() { vec![0] } else { vec![] };
            let places = root.map_or(vec![], |root| {
                root.rows().into_iter().map(|r| DVec3::new(r[0], r[1], r[2])).collect()
            });
            rig::Clip::new(skeleton, 1.0 / fps, moving, places, rotations)
        });
        Ok(Self { clip: clip.map_err(value_error)?, dialect: None })
    }

    /// Joints by name, parents first.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.clip.skeleton().joints().iter().map(|joint| joint.name.as_str()).collect()
    }

    /// Index of each joint's parent, -1 for the root.
    #[getter]
    fn parents(&self) -> Vec<i64> {
        let joints = self.clip.skeleton().joints().iter();
        joints.map(|joint| joint.parent.map_or(-1, |parent| parent as i64)).collect()
    }

    /// (J, 3) rest translations from the parent.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        points(self.clip.skeleton().joints().iter().map(|joint| joint.offset)).into_pyarray(py)
    }

    /// Index of the joint that each tip hangs on.
    #[getter]
    fn tip_joints(&self) -> Vec<usize> {
        let joints = self.clip.skeleton().joints().iter().enumerate();
        joints.flat_map(|(index, joint)| joint.tips.iter().map(move |_| index)).collect()
    }

    /// (K, 3) ends of bones without a joint of their own, in the frame of their joint.
    #[getter]
    fn tips<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let joints = self.clip.skeleton().joints().iter();
        let tips: Vec<_> = joints.flat_map(|joint| joint.tips.iter().copied()).collect();
        points(tips.into_iter()).into_pyarray(py)
    }

    /// Frames a second.
    #[getter]
    fn fps(&self) -> f64 {
        self.clip.fps()
    }

    /// Number of frames.
    #[getter]
    fn frames(&self) -> usize {
        self.clip.frames()
    }

    /// Seconds from the first frame to the last.
    #[getter]
    fn duration(&self) -> f64 {
        self.clip.duration()
    }

    /// (F, J, 4) local rotations as (x, y, z, w).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let (frames, joints) = (self.clip.frames(), self.clip.skeleton().len());
        let numbers = py.detach(|| {
            (0..frames).flat_map(|f| self.clip.rotations(f)).flat_map(|q| q.to_array()).collect()
        });
        let array = Array3::from_shape_vec((frames, joints, 4), numbers);
        array.expect("four numbers a rotation").into_pyarray(py)
    }

    /// (F, J, 3) local translations: the offset where a joint keeps it.
    #[getter]
    fn translations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let (frames, joints) = (self.clip.frames(), self.clip.skeleton().len());
        let numbers = py.detach(|| {
            (0..frames).flat_map(|f| self.local(f)).flat_map(|p| p.to_array()).collect()
        });
        let array = Array3::from_shape_vec((frames, joints, 3), numbers);
        array.expect("three numbers a translation").into_pyarray(py)
    }

    /// (F, J, 3) places of all joints in the world.
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f32>> {
        let (frames, joints) = (self.clip.frames(), self.clip.skeleton().len());
        let numbers = py.detach(|| {
            let mut places = vec![];
            let mut numbers = Vec::with_capacity(frames * joints * 3);
            for frame in 0..frames {
                self.clip.positions(frame, &mut places);
                numbers.extend(places.iter().flat_map(|place| place.as_vec3().to_array()));
            }
            numbers
        });
        let array = Array3::from_shape_vec((frames, joints, 3), numbers);
        array.expect("three numbers a place").into_pyarray(py)
    }

    /// The same motion at another rate.
    fn resampled(&self, py: Python<'_>, fps: f64) -> PyResult<Self> {
        Ok(self.with(py.detach(|| self.clip.resampled(fps)).map_err(value_error)?))
    }

    /// Frames from `start` up to, not including, `end`.
    fn slice(&self, start: usize, end: usize) -> PyResult<Self> {
        Ok(self.with(self.clip.slice(start, end).map_err(value_error)?))
    }

    /// Left and right exchanged. `method`: partners by 'name', by 'geometry', or 'auto': by name
    /// where the names tell sides. `axes`: what the clip is in.
    #[pyo3(signature = (method = "auto", axes = "ambulo"))]
    fn mirrored(&self, py: Python<'_>, method: &str, axes: &str) -> PyResult<Self> {
        if !["auto", "name", "geometry"].contains(&method) {
            let message =
                format!("method '{method}' is not known; expected auto, name or geometry");
            return Err(PyValueError::new_err(message));
        }
        let lateral = Axes::named(axes).map_err(value_error)?.left();
        let clip = py.detach(|| self.mirror(method, lateral)?.apply(&self.clip));
        Ok(self.with(clip.map_err(value_error)?))
    }

    /// The same motion in other axes and units, both by name (`motion_axes`).
    fn converted(&self, py: Python<'_>, from_axes: &str, to_axes: &str) -> PyResult<Self> {
        let named = |name| Axes::named(name).map_err(value_error);
        let conversion = named(from_axes)?.to(named(to_axes)?).map_err(value_error)?;
        Ok(self.with(py.detach(|| self.clip.converted(&conversion))))
    }

    fn __repr__(&self) -> String {
        let (frames, joints) = (self.clip.frames(), self.clip.skeleton().len());
        format!("<Clip: {frames} frames at {} fps, {joints} joints>", self.clip.fps())
    }
}

/// Names of axes and units that a clip can be converted from and to.
#[pyfunction]
pub fn motion_axes() -> Vec<&'static str> {
    Axes::PRESETS.iter().map(|(name, _)| *name).collect()
}

/// Reads a motion file (.bvh, or .amc with its .asf beside it): the clip in the file's own units
/// and axes, and a report. `fps` is for files that store no rate (AMC; 120 without it).
#[pyfunction]
#[pyo3(signature = (path, *, repair = false, fps = None, positions = "replace"))]
pub fn read_motion<'py>(
    py: Python<'py>,
    path: PathBuf,
    repair: bool,
    fps: Option<f64>,
    positions: &str,
) -> PyResult<(Clip, Bound<'py, PyDict>)> {
    let usual = ReadOptions::default();
    let positions = match positions {
        "replace" => Positions::Replace,
        "add" => Positions::Add,
        _ => {
            let message = format!("positions '{positions}' is not known; expected replace or add");
            return Err(PyValueError::new_err(message));
        }
    };
    let fps = fps.unwrap_or(usual.fps);
    if !(1e-3..=1e6).contains(&fps) {
        return Err(PyValueError::new_err(format!("fps is {fps}, expected 0.001 to 1000000")));
    }
    let options = ReadOptions { repair, positions, fps };
    let read = py.detach(|| {
        let file = read_path(&path, &options)?;
        let detected = detect(&file.clip, positions);
        Ok((file, detected))
    });
    let (file, detected) = read.map_err(|error: FileError| file_error(py, error))?;
    let report = PyDict::new(py);
    report.set_item("format", file.format.suffix())?;
    report.set_item("frames", file.clip.frames())?;
    report.set_item("fps", file.clip.fps())?;
    report.set_item("seconds", file.clip.frames() as f64 * file.clip.frame_time())?;
    report.set_item("joints", file.clip.skeleton().len())?;
    report.set_item("metres_per_unit", file.metres_per_unit)?;
    report.set_item("axes", file.axes())?;
    if let Some(marks) = &file.marks {
        let phases = marks.phases.iter().map(|p| (p.name.as_str(), p.start, p.end, p.loops));
        report.set_item("phases", phases.collect::<Vec<_>>())?;
        let events = marks.events.iter().map(|event| (event.name.as_str(), event.time));
        report.set_item("events", events.collect::<Vec<_>>())?;
    }
    report.set_item("notes", texts(&file.notes))?;
    report.set_item("detected", described(py, &detected)?)?;
    Ok((Clip { clip: file.clip, dialect: file.dialect }, report))
}

/// Writes a clip as BVH, whole or not at all, with the channels of the file that it came from;
/// returns notes on what differs from that.
#[pyfunction]
pub fn write_motion(py: Python<'_>, path: PathBuf, clip: &Clip) -> PyResult<Vec<String>> {
    let options = WriteOptions { dialect: clip.dialect.clone() };
    let path: &Path = &path;
    let notes = py.detach(|| write_path(path, &clip.clip, &options));
    Ok(texts(&notes.map_err(|error| file_error(py, error))?))
}

fn texts(notes: &[Note]) -> Vec<String> {
    notes.iter().map(ToString::to_string).collect()
}

fn described<'py>(py: Python<'py>, detected: &Detected) -> PyResult<Bound<'py, PyDict>> {
    let axis = |guess: Option<Guess>| guess.map(|guess| guess.axis.to_string());
    let share = |guess: Option<Guess>| guess.map(|guess| guess.share);
    let handedness = detected.handedness.map(|handedness| match handedness {
        Handedness::Right => "right",
        Handedness::Left => "left",
    });
    let positions = match detected.positions {
        PositionsFit::Replace => "replace",
        PositionsFit::Add => "add",
        PositionsFit::Unneeded => "unneeded",
        PositionsFit::Unclear => "unclear",
    };
    let dict = PyDict::new(py);
    dict.set_item("axes", detected.preset())?;
    dict.set_item("up", axis(detected.up))?;
    dict.set_item("up_share", share(detected.up))?;
    dict.set_item("forward", axis(detected.forward))?;
    dict.set_item("forward_share", share(detected.forward))?;
    dict.set_item("handedness", handedness)?;
    dict.set_item("metres_per_unit", detected.metres_per_unit)?;
    dict.set_item("hips_height", detected.hips_height)?;
    dict.set_item("t_pose_first_frame", detected.t_pose_first_frame)?;
    dict.set_item("positions", positions)?;
    dict.set_item("notes", detected.notes.clone())?;
    Ok(dict)
}
