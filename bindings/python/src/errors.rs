//! Rust errors as Python exceptions: the one place where they are mapped.

use std::io;

use ambulo_body::BodyError;
use ambulo_dataset::DatasetError;
use ambulo_formats::files::FileError;
use ambulo_scene::{FileError as SceneError, VisitError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    ambulo,
    MotionFileError,
    PyValueError,
    "A motion file that is refused. `line` and `column`, both from 1, and the texts `expected` and \
     `found` say where and why; all are None where the file as a whole is meant."
);

pyo3::create_exception!(
    ambulo,
    CreatureFileError,
    PyValueError,
    "A creature file that is refused. `problems` is a list of (path in the document, reason)."
);

pyo3::create_exception!(
    ambulo,
    SceneFileError,
    PyValueError,
    "A scene, an interaction or a script that is refused. `problems` is a list of (path in the \
     document, reason)."
);

/// Input that cannot be used: `ValueError`, with the error's own words.
pub fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A path that cannot be read or written: `OSError` as Python itself has it, else
/// `MotionFileError`.
pub fn file_error(py: Python<'_>, error: FileError) -> PyErr {
    let text = error.to_string();
    let place = match error {
        FileError::Io { source, .. } => return io::Error::new(source.kind(), text).into(),
        FileError::Read(place) => Some(place),
        _ => None,
    };
    let error = MotionFileError::new_err(text);
    let value = error.value(py);
    let (line, column) = place.as_ref().map(|p| (p.line, p.column)).unzip();
    let (expected, found) = place.map(|p| (p.expected, p.found)).unzip();
    let set = value
        .setattr("line", line)
        .and_then(|()| value.setattr("column", column))
        .and_then(|()| value.setattr("expected", expected))
        .and_then(|()| value.setattr("found", found));
    set.err().unwrap_or(error)
}

/// A data set that cannot be built: `OSError` where a file cannot be read or written, else
/// `ValueError`.
pub fn dataset_error(error: DatasetError) -> PyErr {
    match error {
        DatasetError::Io(path, source) => {
            io::Error::new(source.kind(), format!("{}: {source}", path.display())).into()
        }
        error => value_error(error),
    }
}

/// A creature file that is refused.
pub fn creature_error(py: Python<'_>, error: BodyError) -> PyErr {
    let raised = CreatureFileError::new_err(error.to_string());
    let problems: Vec<_> = error.problems().into_iter().map(|p| (p.path, p.reason)).collect();
    raised.value(py).setattr("problems", problems).err().unwrap_or(raised)
}

/// A scene, an interaction or a script that is refused.
pub fn scene_error(py: Python<'_>, error: SceneError) -> PyErr {
    let raised = SceneFileError::new_err(error.to_string());
    let problems: Vec<_> = error.problems().into_iter().map(|p| (p.path, p.reason)).collect();
    raised.value(py).setattr("problems", problems).err().unwrap_or(raised)
}

/// A visit that cannot begin.
pub fn visit_error(py: Python<'_>, error: VisitError) -> PyErr {
    match error {
        VisitError::File(error) => scene_error(py, error),
        error => value_error(error),
    }
}
