//! Data sets: planning and building them, and single clips as rows.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use ambulo_control as control;
use ambulo_dataset::prepare::{LabelFiles, Setup};
use ambulo_dataset::rows::{ClipRows, encode_clip};
use ambulo_dataset::{
    CATEGORIES, ContactSettings, DatasetError, GaitSettings, Loaded, Manifest, RoleNames, build,
    plan,
};
use ambulo_formats::detect::detect;
use ambulo_formats::files::read_path;
use ambulo_formats::{Positions, ReadOptions};
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use crate::errors::{dataset_error, value_error};
use crate::model::Model;

/// Reads a motion file, position channels as its bones say they are meant.
fn load(path: &Path) -> Result<Loaded, String> {
    let options = ReadOptions::default();
    let file = read_path(path, &options).map_err(|error| error.to_string())?;
    let found = detect(&file.clip, Positions::Replace);
    let axes = file.axes().or_else(|| found.preset()).map(str::to_owned).ok_or_else(|| {
        let why = if found.notes.is_empty() { "" } else { ": " };
        format!("its axes and unit cannot be told{why}{}", found.notes.join("; "))
    });
    Ok(Loaded { clip: file.clip, axes })
}

/// Calls back into Python from whatever thread does the work; an exception there stops the work.
struct Callback {
    function: Option<Py<PyAny>>,
    error: Mutex<Option<PyErr>>,
}

impl Callback {
    fn new(function: Option<Py<PyAny>>) -> Self {
        Self { function, error: Mutex::new(None) }
    }

    fn tell(&self, share: f64) -> bool {
        let told = Python::attach(|py| {
            py.check_signals()?;
            match &self.function {
                Some(function) => function.call1(py, (share,)).map(drop),
                None => Ok(()),
            }
        });
        let good = told.is_ok();
        if let Err(error) = told {
            *self.error.lock().expect("nothing panics with it") = Some(error);
        }
        good
    }

    fn finish<T>(self, result: Result<T, DatasetError>) -> PyResult<T> {
        let error = self.error.into_inner().expect("nothing panics with it");
        match (result, error) {
            (Ok(value), _) => Ok(value),
            (Err(DatasetError::Stopped), Some(error)) => Err(error),
            (Err(error), _) => Err(dataset_error(error)),
        }
    }
}

/// Kinds of motion that rows are of, in the order of their numbers.
#[pyfunction]
pub fn dataset_categories() -> Vec<&'static str> {
    CATEGORIES.to_vec()
}

/// Checks the text of a manifest or of settings; returns it as JSON.
#[pyfunction]
pub fn dataset_check(text: &str) -> PyResult<String> {
    let manifest = Manifest::parse(text).map_err(value_error)?;
    serde_json::to_string(&manifest).map_err(value_error)
}

/// Looks at motion files: the text of a manifest for a folder, and the files that are left out,
/// each with the reason. `settings` is the text of a manifest without clips.
#[pyfunction]
#[pyo3(signature = (files, folder, settings = "", *, threads = 1, progress = None))]
pub fn dataset_plan(
    py: Python<'_>,
    files: Vec<PathBuf>,
    folder: PathBuf,
    settings: &str,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Vec<(PathBuf, String)>)> {
    let settings = Manifest::parse(settings).map_err(value_error)?;
    let callback = Callback::new(progress);
    let told = |share| callback.tell(share);
    let planned =
        py.detach(|| plan::plan(&files, &folder, &settings, &load, threads.max(1), &told));
    let planned = callback.finish(planned)?;
    Ok((planned.manifest.to_text().map_err(value_error)?, planned.skipped))
}

/// Builds the shards of a manifest's text in a folder; returns a report as JSON.
#[pyfunction]
#[pyo3(signature = (folder, manifest, *, threads = 1, progress = None))]
pub fn dataset_build(
    py: Python<'_>,
    folder: PathBuf,
    manifest: &str,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let manifest = Manifest::parse(manifest).map_err(value_error)?;
    let callback = Callback::new(progress);
    let told = |share| callback.tell(share);
    let built = py.detach(|| build::build(&folder, &manifest, &load, threads.max(1), &told));
    let built = callback.finish(built)?;
    serde_json::to_string(&built).map_err(value_error)
}

/// The rows of a motion file for a model, as its data set would have them, on level ground: `rows`
/// (N, 6 + inputs + outputs) as in a shard, `runs` of consecutive ones, and `fps`. `axes` names
/// what the file is in where it cannot be told.
#[pyfunction]
#[pyo3(signature = (model, path, *, axes = None, mirrored = false))]
pub fn clip_rows<'py>(
    py: Python<'py>,
    model: &Model,
    path: PathBuf,
    axes: Option<String>,
    mirrored: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let model = control::Model::new(model.bundle.clone()).map_err(value_error)?;
    let rows = py.detach(|| rows_for(&model, &path, axes, mirrored));
    let rows = rows.map_err(|reason| value_error(format!("{}: {reason}", path.display())))?;
    let shape = (rows.rows.len() / rows.width, rows.width);
    let array = Array2::from_shape_vec(shape, rows.rows).expect("whole rows");
    let dict = PyDict::new(py);
    dict.set_item("rows", array.into_pyarray(py))?;
    dict.set_item("runs", rows.runs)?;
    dict.set_item("fps", model.layout().fps())?;
    Ok(dict)
}

fn rows_for(
    model: &control::Model,
    path: &Path,
    axes: Option<String>,
    mirrored: bool,
) -> Result<ClipRows, String> {
    let loaded = load(path)?;
    let axes = match axes {
        Some(axes) => axes,
        None => loaded.axes?,
    };
    let skeleton = model.skeleton();
    let roles = match model.bundle().header().parts.get("roles") {
        Some(roles) => RoleNames::deserialize(roles).map_err(|e| e.to_string())?,
        None => RoleNames::of(&ambulo_rig::Roles::by_name(skeleton), skeleton)?,
    };
    #[derive(Default, Deserialize)]
    #[serde(default)]
    struct HowLabelled {
        drop: Vec<String>,
        contacts: ContactSettings,
        gaits: GaitSettings,
    }
    let labelled = match model.bundle().header().parts.get("labels") {
        Some(labels) => HowLabelled::deserialize(labels).map_err(|e| e.to_string())?,
        None => HowLabelled::default(),
    };
    let setup = Setup {
        layout: model.layout().clone(),
        skeleton: skeleton.clone(),
        roles,
        drop: labelled.drop,
        foot_heights: model.feet().heights,
        contacts: labelled.contacts,
        gaits: labelled.gaits,
    };
    let labels = path.with_extension("labels.txt");
    let labels = LabelFiles::read(path, &labels)?;
    let fitted = setup.fit(&loaded.clip, &axes, None, None)?;
    let ready = setup.label(&fitted, loaded.clip.fps(), mirrored, &labels)?;
    encode_clip(&setup, &ready)
}
