//! Creatures: their files, arenas, searches, controllers.

use std::collections::BTreeMap;

use ambulo_arena as arena;
use ambulo_body::Body;
use ambulo_evolve as evolve;
use ambulo_pilot::{Pilot, PilotScratch, Senses};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::{creature_error, value_error};

/// A checked creature; immutable.
#[pyclass(frozen, module = "ambulo")]
pub struct Creature {
    body: Body,
}

#[pymethods]
impl Creature {
    /// Checks a creature file's text.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str) -> PyResult<Self> {
        Ok(Self { body: Body::parse(text).map_err(|error| creature_error(py, error))? })
    }

    /// As a file: readable JSON.
    fn json(&self) -> String {
        self.body.to_json()
    }

    /// Fingerprint of all that moves, 16 hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        format!("{:016x}", self.body.hash())
    }

    /// What follows from the file: name, mass, length, standing_height, torso, driven joints by
    /// name, legs (name, parts, foot, joints) and pairs.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let body = &self.body;
        let dict = PyDict::new(py);
        dict.set_item("name", &body.description().name)?;
        dict.set_item("hash", self.hash())?;
        dict.set_item("mass", body.mass())?;
        dict.set_item("length", body.length())?;
        dict.set_item("standing_height", body.standing_height())?;
        dict.set_item("torso", body.torso())?;
        let names = body.driven().iter().map(|&joint| &body.joints()[joint].name);
        dict.set_item("driven", names.collect::<Vec<_>>())?;
        let leg = |leg: &ambulo_body::Leg| -> PyResult<Bound<'py, PyDict>> {
            let dict = PyDict::new(py);
            dict.set_item("name", &body.parts()[leg.parts[0]].name)?;
            dict.set_item("parts", &leg.parts)?;
            dict.set_item("foot", leg.foot)?;
            dict.set_item("joints", &leg.joints)?;
            Ok(dict)
        };
        dict.set_item("legs", body.legs().iter().map(leg).collect::<PyResult<Vec<_>>>()?)?;
        dict.set_item("pairs", body.pairs().to_vec())?;
        Ok(dict)
    }
}

/// A body, a kind of controller, a world and a task; immutable.
#[pyclass(frozen, module = "ambulo")]
pub struct Arena {
    arena: arena::Arena,
}

/// (N, G) as a list of genomes.
fn genomes(array: &PyReadonlyArray2<'_, f32>) -> Vec<Vec<f32>> {
    array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}

fn by_name(terms: &arena::Terms) -> BTreeMap<&'static str, f64> {
    terms.iter().map(|(term, value)| (term.name(), *value)).collect()
}

#[pymethods]
impl Arena {
    /// `settings` is JSON text; what it leaves out is as the defaults are.
    #[new]
    fn new(creature: &Creature, settings: &str) -> PyResult<Self> {
        let settings = arena::Settings::parse(settings).map_err(value_error)?;
        let arena = arena::Arena::new(creature.body.clone(), settings).map_err(value_error)?;
        Ok(Self { arena })
    }

    /// The settings with everything said, as JSON text.
    fn settings(&self) -> PyResult<String> {
        serde_json::to_string_pretty(self.arena.settings()).map_err(value_error)
    }

    /// How many numbers a genome has.
    #[getter]
    fn genes(&self) -> usize {
        self.arena.genes()
    }

    /// Physics steps of an episode.
    #[getter]
    fn steps(&self) -> u32 {
        self.arena.steps()
    }

    /// The search at its start.
    fn search(&self) -> PyResult<Genetic> {
        Ok(Genetic { search: self.arena.search().map_err(value_error)? })
    }

    /// (N, G) genomes to (N,) fitness, on so many threads; NaN where nothing came of it.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        array: PyReadonlyArray2<'py, f32>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let genomes = genomes(&array);
        let scores = py.detach(|| self.arena.evaluate(&genomes, threads)).map_err(value_error)?;
        Ok(Array1::from_iter(scores.into_iter().map(|score| score.fitness)).into_pyarray(py))
    }

    /// Fitness of one genome, and all its terms by name.
    fn score(
        &self,
        genome: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<(f64, BTreeMap<&'static str, f64>)> {
        let score = self.arena.score(&genome.as_array().to_vec()).map_err(value_error)?;
        Ok((score.fitness, by_name(&score.terms)))
    }

    /// Records one genome for so many steps from the start.
    fn record(
        &self,
        py: Python<'_>,
        genome: PyReadonlyArray1<'_, f32>,
        steps: u32,
    ) -> PyResult<Recorded> {
        let genome = genome.as_array().to_vec();
        let rollout = py.detach(|| self.arena.record(&genome, steps)).map_err(value_error)?;
        let parts = self.arena.body().parts().len();
        Ok(Recorded { rollout, parts, joints: self.arena.body().driven().len() })
    }

    /// Whether a recorded motion is usable, and its figures, as JSON text.
    fn judge(&self, recorded: &Recorded) -> PyResult<String> {
        serde_json::to_string(&self.arena.judge(&recorded.rollout)).map_err(value_error)
    }

    /// A controller's file: bytes. `provenance` is JSON text of strings by key, `parts` of anything.
    fn controller<'py>(
        &self,
        py: Python<'py>,
        genome: PyReadonlyArray1<'py, f32>,
        licence: &str,
        provenance: &str,
        parts: &str,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let pilot = self.arena.pilot(&genome.as_array().to_vec()).map_err(value_error)?;
        let provenance = serde_json::from_str(provenance).map_err(value_error)?;
        let parts = serde_json::from_str(parts).map_err(value_error)?;
        let rate = f64::from(self.arena.settings().world.rate);
        let bytes = pilot.to_bytes(self.arena.body(), rate, licence, provenance, parts);
        Ok(PyBytes::new(py, &bytes.map_err(value_error)?))
    }
}

/// A recorded episode: T steps, P parts, J driven joints.
#[pyclass(frozen, module = "ambulo")]
pub struct Recorded {
    rollout: arena::Rollout,
    parts: usize,
    joints: usize,
}

impl Recorded {
    fn rows<'py, T: numpy::Element>(
        py: Python<'py>,
        values: Vec<T>,
        columns: usize,
    ) -> Bound<'py, PyArray2<T>> {
        let rows = values.len() / columns.max(1);
        let array = Array2::from_shape_vec((rows, columns), values);
        array.expect("rows of one length").into_pyarray(py)
    }
}

#[pymethods]
impl Recorded {
    /// Seconds a step.
    #[getter]
    fn dt(&self) -> f32 {
        self.rollout.dt
    }

    /// (T + 1, P, 3): x, y, angle.
    fn poses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f32>> {
        let shape = (self.rollout.steps() + 1, self.parts, 3);
        let array = Array3::from_shape_vec(shape, self.rollout.poses.clone());
        array.expect("three numbers a pose").into_pyarray(py)
    }

    /// (T + 1, P): the part touches the ground.
    fn touching<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<bool>> {
        Self::rows(py, self.rollout.touching.clone(), self.parts)
    }

    /// (T + 1, J): radians from the start pose.
    fn angles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        Self::rows(py, self.rollout.angles.clone(), self.joints)
    }

    /// (T, J): what the motors were told, −1 to 1.
    fn commands<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        Self::rows(py, self.rollout.commands.clone(), self.joints)
    }

    /// (T, J): newton metres.
    fn torques<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        Self::rows(py, self.rollout.torques.clone(), self.joints)
    }

    /// (N, 2): the ground's line from left to right.
    fn ground<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        Self::rows(py, self.rollout.ground.concat(), 2)
    }

    /// Fingerprint of all steps, 16 hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        format!("{:016x}", self.rollout.hash)
    }
}

/// The seed's genetic algorithm with its whole state.
#[pyclass(module = "ambulo")]
pub struct Genetic {
    search: evolve::Genetic,
}

#[pymethods]
impl Genetic {
    /// From a stored state.
    #[staticmethod]
    fn restore(state: &str) -> PyResult<Self> {
        let search: evolve::Genetic = serde_json::from_str(state).map_err(value_error)?;
        search.check().map_err(value_error)?;
        Ok(Self { search })
    }

    /// The whole state, as JSON text.
    fn state(&self) -> PyResult<String> {
        serde_json::to_string(&self.search).map_err(value_error)
    }

    /// How many generations were told.
    #[getter]
    fn generation(&self) -> u64 {
        self.search.generation()
    }

    /// (N, G): the genomes whose fitness it wants to know.
    fn ask<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let genomes = self.search.ask();
        let columns = genomes.first().map_or(0, Vec::len);
        let array = Array2::from_shape_vec((genomes.len(), columns), genomes.concat());
        array.expect("genomes of one length").into_pyarray(py)
    }

    /// Takes a fitness for each; the next generation is made.
    fn tell(&mut self, fitness: Vec<f64>) -> PyResult<()> {
        self.search.tell(&fitness).map_err(value_error)
    }
}

/// A saved controller: senses in, motor speeds out; no physics.
#[pyclass(module = "ambulo")]
pub struct CreatureController {
    pilot: Pilot,
    body: Body,
    header: String,
    scratch: PilotScratch,
    senses: Senses,
}

#[pymethods]
impl CreatureController {
    /// Reads a controller's file.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let (pilot, body, header) = Pilot::from_bytes(bytes).map_err(value_error)?;
        let header = serde_json::to_string(&header).map_err(value_error)?;
        let (scratch, senses) = (pilot.scratch(), Senses::default());
        Ok(Self { pilot, body, header, scratch, senses })
    }

    /// The header as JSON text.
    fn header_json(&self) -> &str {
        &self.header
    }

    /// The creature that it was made for.
    fn creature(&self) -> Creature {
        Creature { body: self.body.clone() }
    }

    /// Its make, as JSON text.
    fn settings(&self) -> PyResult<String> {
        serde_json::to_string(self.pilot.settings()).map_err(value_error)
    }

    /// Its genome.
    fn genome<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        self.pilot.network().genome().to_vec().into_pyarray(py)
    }

    /// Widths of the network, inputs to outputs.
    #[getter]
    fn widths(&self) -> Vec<usize> {
        self.pilot.network().widths().to_vec()
    }

    /// Motor speeds, radians a second, of what is sensed (SI units; only what its sensors ask for
    /// is used).
    #[pyo3(signature = (torso_rotation, joint_angles, joint_speeds=None, foot_contacts=None,
        height=0.0, velocity=[0.0, 0.0], ground_rays=None))]
    #[allow(clippy::too_many_arguments)] // The senses, by name.
    fn drive<'py>(
        &mut self,
        py: Python<'py>,
        torso_rotation: f32,
        joint_angles: Vec<f32>,
        joint_speeds: Option<Vec<f32>>,
        foot_contacts: Option<Vec<bool>>,
        height: f32,
        velocity: [f32; 2],
        ground_rays: Option<Vec<f32>>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        self.senses = Senses {
            torso_rotation,
            joint_angles,
            joint_speeds: joint_speeds.unwrap_or_default(),
            foot_contacts: foot_contacts.unwrap_or_default(),
            height,
            velocity,
            ground_rays: ground_rays.unwrap_or_default(),
        };
        self.pilot.check(&self.senses).map_err(value_error)?;
        let mut speeds = vec![0.0; self.pilot.joints()];
        self.pilot.drive(&self.senses, &mut speeds, &mut self.scratch);
        Ok(speeds.into_pyarray(py))
    }
}

/// Name, description, steps and weights of every task.
#[pyfunction]
pub fn creature_tasks(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let task = |task: &&'static dyn arena::Task| -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("name", task.name())?;
        dict.set_item("about", task.about())?;
        dict.set_item("steps", task.steps())?;
        let weights = task.weights().iter().map(|(term, weight)| (term.name(), *weight));
        dict.set_item("weights", weights.collect::<BTreeMap<_, _>>())?;
        Ok(dict)
    };
    arena::TASKS.iter().map(task).collect()
}
