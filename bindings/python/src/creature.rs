//! Creatures: their files, arenas, searches, controllers.

use std::collections::BTreeMap;

use ambulo_arena as arena;
use ambulo_body::Body;
use ambulo_lanes::Width;
use ambulo_pilot::{Kind, Pilot, PilotScratch, Senses};
use numpy::ndarray::{Array2, Array3};
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

impl Arena {
    /// (N, G) as a list of genomes; where they may differ in length, what fills them up is taken off.
    fn genomes(&self, array: &PyReadonlyArray2<'_, f32>) -> Vec<Vec<f32>> {
        let rows = array.as_array();
        rows.rows().into_iter().map(|row| self.genome(&row.to_vec())).collect()
    }

    fn genome(&self, row: &[f32]) -> Vec<f32> {
        let whole = match self.arena.settings().controller.kind {
            Some(Kind::Graph) => {
                row.iter().rposition(|gene| !gene.is_nan()).map_or(0, |last| last + 1)
            }
            _ => row.len(),
        };
        row[..whole].to_vec()
    }
}

/// Scores as rows: fitness, share before a fall, two numbers of the kind of motion, promising.
fn rows_of(py: Python<'_>, scores: Vec<arena::Score>) -> Bound<'_, PyArray2<f64>> {
    let row = |score: arena::Score| {
        let promising = if score.promising { 1.0 } else { 0.0 };
        [score.fitness, score.alive, score.behaviour[0], score.behaviour[1], promising]
    };
    Recorded::rows(py, scores.into_iter().flat_map(row).collect(), 5)
}

fn by_name(terms: &arena::Terms) -> BTreeMap<&'static str, f64> {
    terms.iter().map(|(term, value)| (term.name(), *value)).collect()
}

#[pymethods]
impl Arena {
    /// `settings` is JSON text; what it leaves out is as the defaults are. `lanes`: how many
    /// individuals are stepped together, 1, 4, 8 or 16; as many as this machine has if left out. The
    /// results are the same.
    #[new]
    #[pyo3(signature = (creature, settings, lanes=None))]
    fn new(creature: &Creature, settings: &str, lanes: Option<usize>) -> PyResult<Self> {
        let settings = arena::Settings::parse(settings).map_err(value_error)?;
        let arena = arena::Arena::new(creature.body.clone(), settings).map_err(value_error)?;
        let Some(lanes) = lanes else { return Ok(Self { arena }) };
        let width = Width::available().find(|width| width.lanes() == lanes);
        let width = width.ok_or_else(|| {
            let known: Vec<_> = Width::available().map(|width| width.lanes().to_string()).collect();
            value_error(format!("lanes: {lanes}; this machine has {}", known.join(", ")))
        })?;
        Ok(Self { arena: arena.with_width(width) })
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

    /// How many individuals are stepped together.
    #[getter]
    fn lanes(&self) -> usize {
        self.arena.width().lanes()
    }

    /// Physics steps of an episode.
    #[getter]
    fn steps(&self) -> u32 {
        self.arena.steps()
    }

    /// Physics steps of the episodes of each stage; the last is of full length.
    #[getter]
    fn stages(&self) -> Vec<u32> {
        self.arena.stages()
    }

    /// The search at its start.
    fn search(&self) -> PyResult<Search> {
        Ok(Search { search: arena::Evolution::new(&self.arena).map_err(value_error)? })
    }

    /// A stored search, to go on with.
    fn restore(&self, state: &str) -> PyResult<Search> {
        let search: arena::Evolution = serde_json::from_str(state).map_err(value_error)?;
        search.check(&self.arena).map_err(value_error)?;
        Ok(Search { search })
    }

    /// (N, G) genomes to (N, 5) scores in episodes of so many steps (of full length if left out):
    /// fitness (NaN where nothing came of it), share of the episode before a fall, two numbers that
    /// say what kind of motion it is, and 1 if it may be usable, else 0.
    #[pyo3(signature = (array, threads, steps=None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        array: PyReadonlyArray2<'py, f32>,
        threads: usize,
        steps: Option<u32>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let genomes = self.genomes(&array);
        let steps = steps.unwrap_or(self.arena.steps());
        let scores = py.detach(|| self.arena.evaluate(&genomes, steps, threads));
        Ok(rows_of(py, scores.map_err(value_error)?))
    }

    /// The same in a round of a search, JSON text as `Search.round` gives it.
    fn try_round<'py>(
        &self,
        py: Python<'py>,
        array: PyReadonlyArray2<'py, f32>,
        round: &str,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let genomes = self.genomes(&array);
        let round = serde_json::from_str(round).map_err(value_error)?;
        let scores = py.detach(|| self.arena.try_round(&genomes, round, threads));
        Ok(rows_of(py, scores.map_err(value_error)?))
    }

    /// The creature that a genome means: the arena's, or where bodies evolve one with other measures.
    fn creature_of(&self, genome: PyReadonlyArray1<'_, f32>) -> PyResult<Creature> {
        let body = self.arena.body_of(&self.genome(&genome.as_array().to_vec()));
        Ok(Creature { body: (*body.map_err(value_error)?).clone() })
    }

    /// How each genome's motion holds up under other physics, as JSON text.
    fn robustness(
        &self,
        py: Python<'_>,
        array: PyReadonlyArray2<'_, f32>,
        threads: usize,
    ) -> PyResult<String> {
        let genomes = self.genomes(&array);
        let found = py.detach(|| self.arena.robustness(&genomes, threads)).map_err(value_error)?;
        serde_json::to_string(&found.iter().map(robustness).collect::<Vec<_>>())
            .map_err(value_error)
    }

    /// Fitness of one genome, and all its terms by name.
    fn score(
        &self,
        genome: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<(f64, BTreeMap<&'static str, f64>)> {
        let score =
            self.arena.score(&self.genome(&genome.as_array().to_vec())).map_err(value_error)?;
        Ok((score.fitness, by_name(&score.terms)))
    }

    /// Records one genome for so many steps from the start.
    fn record(
        &self,
        py: Python<'_>,
        genome: PyReadonlyArray1<'_, f32>,
        steps: u32,
    ) -> PyResult<Recorded> {
        let genome = self.genome(&genome.as_array().to_vec());
        let rollout = py.detach(|| self.arena.record(&genome, steps)).map_err(value_error)?;
        let parts = self.arena.body().parts().len();
        Ok(Recorded { rollout, parts, joints: self.arena.body().driven().len() })
    }

    /// Whether a recorded motion is usable, and its figures, as JSON text.
    fn judge(&self, recorded: &Recorded) -> PyResult<String> {
        serde_json::to_string(&self.arena.judge(&recorded.rollout)).map_err(value_error)
    }

    /// A controller's file, of the creature that the genome means: bytes. `provenance` is JSON text of strings by key, `parts` of anything.
    fn controller<'py>(
        &self,
        py: Python<'py>,
        genome: PyReadonlyArray1<'py, f32>,
        licence: &str,
        provenance: &str,
        parts: &str,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let genome = self.genome(&genome.as_array().to_vec());
        let pilot = self.arena.pilot(&genome).map_err(value_error)?;
        let body = self.arena.body_of(&genome).map_err(value_error)?;
        let provenance = serde_json::from_str(provenance).map_err(value_error)?;
        let parts = serde_json::from_str(parts).map_err(value_error)?;
        let rate = f64::from(self.arena.settings().world.rate);
        let bytes = pilot.to_bytes(&body, rate, licence, provenance, parts);
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

/// What is told of how a motion holds up.
fn robustness(found: &arena::Robustness) -> serde_json::Value {
    serde_json::json!({
        "robust": found.is_robust(),
        "usable": found.usable,
        "friction": found.friction,
        "mass": found.mass,
        "pushes": found.pushes,
    })
}

/// A search with its whole state.
#[pyclass(module = "ambulo")]
pub struct Search {
    search: arena::Evolution,
}

/// Place among kinds of motions, fitness, genome.
type Elite<'py> = (Vec<usize>, f64, Bound<'py, PyArray1<f32>>);

fn told<'py>(py: Python<'py>, told: arena::Told) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("best", told.best)?;
    dict.set_item("mean", told.mean)?;
    dict.set_item("steps", told.steps)?;
    dict.set_item("ahead", told.ahead)?;
    dict.set_item("crowned", told.crowned)?;
    dict.set_item("learned", told.learned)?;
    dict.set_item("restarted", told.restarted)?;
    Ok(dict)
}

#[pymethods]
impl Search {
    /// The whole state, as JSON text.
    fn state(&self) -> PyResult<String> {
        serde_json::to_string(&self.search).map_err(value_error)
    }

    /// How many generations were told.
    #[getter]
    fn generation(&self) -> u64 {
        self.search.generation()
    }

    /// How often it began anew.
    #[getter]
    fn restarts(&self) -> u64 {
        self.search.restarts()
    }

    /// (N, G): the genomes whose fitness it wants to know; where they differ in length, shorter ones
    /// are filled up with NaN.
    fn ask<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let genomes = self.search.ask();
        let longest = genomes.iter().map(Vec::len).max().unwrap_or(0);
        let row = |genome: &Vec<f32>| {
            let mut row = genome.clone();
            row.resize(longest, f32::NAN);
            row
        };
        Recorded::rows(py, genomes.iter().flat_map(row).collect(), longest)
    }

    /// How they are tried, for `Arena.try_round`: JSON text.
    fn round(&self, arena: &Arena) -> PyResult<String> {
        serde_json::to_string(&self.search.round(&arena.arena)).map_err(value_error)
    }

    /// How many lessons are ahead of the task itself.
    #[getter]
    fn ahead(&self) -> usize {
        self.search.ahead()
    }

    /// Takes the scores of the genomes that it asked for, (N, 5) as `Arena.try_round` gives them; the
    /// next generation is made. Gives best, mean, steps, ahead, crowned, learned, restarted.
    fn tell<'py>(
        &mut self,
        py: Python<'py>,
        arena: &Arena,
        scores: PyReadonlyArray2<'py, f64>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rows = scores.as_array();
        if rows.ncols() != 5 {
            return Err(value_error("scores: 5 numbers each are expected"));
        }
        let score = |row: numpy::ndarray::ArrayView1<'_, f64>| arena::Score {
            fitness: row[0],
            alive: row[1],
            behaviour: [row[2], row[3]],
            promising: row[4] > 0.5,
            terms: arena::Terms::new(),
        };
        let scores: Vec<_> = rows.rows().into_iter().map(score).collect();
        let found = py.detach(|| self.search.tell(&arena.arena, &scores, threads));
        told(py, found.map_err(value_error)?)
    }

    /// A generation: asked, evaluated on so many threads, told.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        arena: &Arena,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = py.detach(|| self.search.step(&arena.arena, threads));
        told(py, found.map_err(value_error)?)
    }

    /// Genome, fitness, generation, robustness (or None) and whether it is good; None before there is
    /// one.
    fn champion<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(champion) = self.search.champion() else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("genome", champion.genome.clone().into_pyarray(py))?;
        dict.set_item("fitness", champion.fitness)?;
        dict.set_item("generation", champion.generation)?;
        let found = champion.robustness.as_ref().map(|found| robustness(found).to_string());
        dict.set_item("robustness", found)?;
        dict.set_item("good", champion.good)?;
        Ok(Some(dict))
    }

    /// Different motions to choose from, of MAP-Elites: place among kinds, fitness and genome of each.
    fn archive<'py>(&self, py: Python<'py>) -> Vec<Elite<'py>> {
        let elite = |(cell, fitness, genome): (&[usize], f64, &[f32])| {
            (cell.to_vec(), fitness, genome.to_vec().into_pyarray(py))
        };
        self.search.archive().into_iter().map(elite).collect()
    }

    /// Whether the champion is `usable`, `robust` or `good` (and robust).
    fn has(&self, what: &str) -> PyResult<bool> {
        let until: arena::Until =
            serde_json::from_value(what.into()).map_err(|_| value_error(format!("no '{what}'")))?;
        Ok(self.search.champion().is_some_and(|champion| champion.is(until)))
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
        self.pilot.genome().to_vec().into_pyarray(py)
    }

    /// Widths of a plain network, inputs to outputs; nothing of other controllers.
    #[getter]
    fn widths(&self) -> Vec<usize> {
        self.pilot.network().map_or(vec![], |network| network.widths().to_vec())
    }

    /// Motor speeds, radians a second, of what is sensed (SI units; only what its sensors ask for
    /// is used; all but plain networks need the joints' angles and the time since they began).
    #[pyo3(signature = (torso_rotation, joint_angles, joint_speeds=None, foot_contacts=None,
        height=0.0, velocity=[0.0, 0.0], ground_rays=None, time=0.0))]
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
        time: f32,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        self.senses = Senses {
            time,
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
        dict.set_item("controller", task.controller().name())?;
        let weights = task.weights().iter().map(|(term, weight)| (term.name(), *weight));
        dict.set_item("weights", weights.collect::<BTreeMap<_, _>>())?;
        Ok(dict)
    };
    arena::TASKS.iter().map(task).collect()
}
