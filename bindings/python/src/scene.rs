//! Scenes, what can be done in them, and visits.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use ambulo_control as control;
use ambulo_rig::Transform;
use ambulo_scene as scene;
use ambulo_scene::{Body, Happened, Interaction, Measured, Moves, Scene, Script, VisitError};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::character::heights;
use crate::errors::{scene_error, value_error, visit_error};
use crate::model::Model;
use crate::motion::Clip;

/// Frames between two looks at whether a visit is to be stopped, and how often Ctrl-C is asked for.
const ASK: (u32, Duration) = (60, Duration::from_millis(100));

fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(value_error)
}

/// Checks a scene's text and, with `interactions` (file → text), whether its objects can offer them;
/// returns it as JSON.
#[pyfunction]
#[pyo3(signature = (text, interactions = None))]
pub fn read_scene(
    py: Python<'_>,
    text: &str,
    interactions: Option<HashMap<String, String>>,
) -> PyResult<String> {
    let scene = Scene::parse(text).map_err(|error| scene_error(py, error))?;
    if let Some(texts) = interactions {
        let read = |(file, text): (String, String)| Ok((file, Interaction::parse(&text)?));
        let all = texts.into_iter().map(read).collect::<Result<HashMap<_, _>, _>>();
        let all = all.map_err(|error| scene_error(py, error))?;
        let fits = scene.check_interactions(|file| all.get(file));
        fits.map_err(|error| scene_error(py, error))?;
    }
    json(&scene)
}

/// Checks an interaction's text; returns it as JSON.
#[pyfunction]
pub fn read_interaction(py: Python<'_>, text: &str) -> PyResult<String> {
    json(&Interaction::parse(text).map_err(|error| scene_error(py, error))?)
}

/// Checks a script's text and, with the text of a scene, whether it fits that; returns it as JSON.
#[pyfunction]
#[pyo3(signature = (text, scene = None))]
pub fn read_script(py: Python<'_>, text: &str, scene: Option<&str>) -> PyResult<String> {
    let script = Script::parse(text).map_err(|error| scene_error(py, error))?;
    if let Some(scene) = scene {
        let scene = Scene::parse(scene).map_err(|error| scene_error(py, error))?;
        script.check_against(&scene).map_err(|error| scene_error(py, error))?;
    }
    json(&script)
}

/// Line and column, from 1, of what a path in a document names; None where it leads nowhere.
#[pyfunction]
pub fn document_place(text: &str, path: &str) -> Option<(usize, usize)> {
    scene::place(text, path)
}

/// All that a visit needs, read and made ready.
struct Ready {
    scene: Scene,
    script: Script,
    model: control::Model,
    body: Arc<Body>,
    moves: Arc<Moves>,
}

impl Ready {
    fn new(
        py: Python<'_>,
        model: &Model,
        scene: &str,
        script: &str,
        interactions: BTreeMap<String, String>,
        clips: &HashMap<String, Py<Clip>>,
    ) -> PyResult<Self> {
        let refused = |error| scene_error(py, error);
        let scene = Scene::parse(scene).map_err(refused)?;
        let script = Script::parse(script).map_err(refused)?;
        let read = |(file, text): (String, String)| Ok((file, Interaction::parse(&text)?));
        let all = interactions.into_iter().map(read).collect::<Result<Vec<_>, _>>();
        let all = all.map_err(refused)?;
        let find = |file: &str| all.iter().find(|(name, _)| name == file).map(|(_, one)| one);
        scene.check_interactions(find).map_err(refused)?;
        let model = control::Model::new(model.bundle.clone()).map_err(value_error)?;
        let body = Arc::new(Body::new(&model).map_err(value_error)?);
        let clip = |file: &str| clips.get(file).map(|clip| &clip.get().clip);
        let moves = Arc::new(Moves::new(&body, &scene, &all, clip).map_err(value_error)?);
        Ok(Self { scene, script, model, body, moves })
    }

    fn visit(&self, seed: u64) -> Result<scene::Visit, VisitError> {
        let (body, moves) = (Arc::clone(&self.body), Arc::clone(&self.moves));
        scene::Visit::new(&self.scene, &self.script, &self.model, body, moves, seed)
    }
}

/// Limb, weight, where it should be and where it is.
type LedFacts = (String, f32, [f32; 7], [f32; 7]);

fn seven(at: Transform) -> [f32; 7] {
    let ([x, y, z], [a, b, c, d]) = (at.translation.to_array(), at.rotation.to_array());
    [x, y, z, a, b, c, d]
}

fn rows<const N: usize>(rows: Vec<[f32; N]>) -> Array2<f32> {
    let shape = (rows.len(), N);
    Array2::from_shape_vec(shape, rows.into_iter().flatten().collect()).expect("N numbers a row")
}

/// A character that plays a script in a scene, 60 frames a second. Places are the world's, metres.
#[pyclass(frozen, module = "ambulo")]
pub struct Visit {
    visit: Mutex<scene::Visit>,
}

impl Visit {
    fn now(&self) -> MutexGuard<'_, scene::Visit> {
        self.visit.lock().expect("nothing panics with it")
    }
}

#[pymethods]
impl Visit {
    /// `interactions` (file → text) are those that the scene names, `clips` (file → clip, in our
    /// axes) those that they name. A seed other than 0 breaks some of them off.
    #[new]
    #[pyo3(signature = (model, scene, script, interactions, clips, seed = 0))]
    fn new(
        py: Python<'_>,
        model: &Model,
        scene: &str,
        script: &str,
        interactions: BTreeMap<String, String>,
        clips: HashMap<String, Py<Clip>>,
        seed: u64,
    ) -> PyResult<Self> {
        let ready = Ready::new(py, model, scene, script, interactions, &clips)?;
        let visit = ready.visit(seed).map_err(|error| visit_error(py, error))?;
        Ok(Self { visit: Mutex::new(visit) })
    }

    /// Moves on by so many frames; whether it goes on.
    #[pyo3(signature = (frames = 1))]
    fn step(&self, py: Python<'_>, frames: u32) -> bool {
        py.detach(|| {
            let mut visit = self.now();
            (0..frames).all(|_| visit.step())
        })
    }

    /// Seconds since the start.
    #[getter]
    fn time(&self) -> f32 {
        self.now().time()
    }

    /// Seconds of a frame.
    #[classattr]
    fn dt() -> f32 {
        scene::STEP
    }

    /// (J, 3) places of the joints, in skeleton order.
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let visit = self.now();
        let places = visit.actor().global().iter().map(|at| at.translation.to_array());
        rows(places.collect()).into_pyarray(py)
    }

    /// (K, 3) tips of the bones that end without a joint, in skeleton order.
    fn tips<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let visit = self.now();
        let joints = visit.actor().body().skeleton().joints().iter().zip(visit.actor().global());
        let tips = joints
            .flat_map(|(joint, at)| joint.tips.iter().map(|tip| at.transform_point(tip.as_vec3())));
        rows(tips.map(|tip| tip.to_array()).collect()).into_pyarray(py)
    }

    /// Place of the root on the ground and its yaw: x, y, z in metres, radians.
    #[getter]
    fn root(&self) -> (f32, f32, f32, f32) {
        let root = self.now().actor().root();
        (root.position.x, root.position.y, root.position.z, root.yaw)
    }

    /// Left heel, left toe, right heel, right toe, as the network has them, 0 to 1.
    #[getter]
    fn contacts(&self) -> [f32; 4] {
        self.now().actor().controller().contacts()
    }

    /// Whether left and right foot are held where they stand.
    #[getter]
    fn stands(&self) -> [bool; 2] {
        self.now().actor().stands()
    }

    /// The limbs that were led: name, weight, where it should be and where it is, x y z qx qy qz qw.
    fn led(&self) -> PyResult<Vec<LedFacts>> {
        let visit = self.now();
        let led = visit.actor().led().iter();
        led.map(|led| {
            let limb = serde_json::to_value(led.limb).map_err(value_error)?;
            let limb = limb.as_str().unwrap_or_default().to_owned();
            Ok((limb, led.weight, seven(led.wanted), seven(led.reached)))
        })
        .collect()
    }

    /// (P, 7) where the parts of all objects are, x y z qx qy qz qw, in the order of `parts`.
    fn part_transforms<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let visit = self.now();
        let physics = visit.physics();
        let parts = (0..physics.objects())
            .flat_map(|object| (0..physics.parts(object).len()).map(move |part| (object, part)));
        let at = parts.filter_map(|(object, part)| physics.part(object, part)).map(seven);
        rows(at.collect()).into_pyarray(py)
    }

    /// The parts of all objects, one object after the other: `object` (its index), `name`, `moves`,
    /// `solids` (centre, half the extents), and `frames` (name → x y z qx qy qz qw) that move with it.
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let visit = self.now();
        let mut all = vec![];
        for (object, of) in visit.scene().objects.iter().enumerate() {
            for (index, part) in visit.physics().parts(object).iter().enumerate() {
                let of_part = |&name: &&'static str| {
                    let frame = of.kind.frame(name)?;
                    (frame.part == Some(index)).then(|| (name, seven(frame.at)))
                };
                let solids = part.solids.iter().map(|s| (s.centre.to_array(), s.half.to_array()));
                let dict = PyDict::new(py);
                dict.set_item("object", object)?;
                dict.set_item("name", part.name)?;
                dict.set_item("moves", part.motion != scene::Motion::Fixed)?;
                dict.set_item("solids", solids.collect::<Vec<_>>())?;
                let frames = of.kind.kind().frames().iter().filter_map(of_part);
                dict.set_item("frames", frames.collect::<HashMap<_, _>>())?;
                all.push(dict);
            }
        }
        Ok(all)
    }

    /// The scene as JSON, as its file has it.
    fn scene(&self) -> PyResult<String> {
        json(self.now().scene())
    }

    /// Heights of the ground at points (x, z) of two arrays of the same length.
    fn heights<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f32>,
        z: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        heights(py, self.now().physics().ground(), x, z)
    }

    /// What happened so far, as JSON: a list of `time`, `what`, `object`, `interaction`.
    fn happened(&self) -> PyResult<String> {
        json(&self.now().happened())
    }

    /// What was measured so far, as JSON.
    fn measured(&self) -> PyResult<String> {
        json(&self.now().measured())
    }
}

/// A visit that was played to its end.
#[derive(Serialize)]
struct Visited {
    seed: u64,
    measured: Measured,
    happened: Vec<Happened>,
}

/// Plays one visit for each of `seeds` to its end, on `threads` threads; the numbers do not depend on
/// how many. `progress` is called with how many are over. Returns a list as JSON, in the order of
/// `seeds`: `seed`, `measured`, `happened`.
#[pyfunction]
#[pyo3(signature = (model, scene, script, interactions, clips, seeds, *, threads = 1, progress = None))]
#[allow(clippy::too_many_arguments)]
pub fn visit_seeds(
    py: Python<'_>,
    model: &Model,
    scene: &str,
    script: &str,
    interactions: BTreeMap<String, String>,
    clips: HashMap<String, Py<Clip>>,
    seeds: Vec<u64>,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let ready = Ready::new(py, model, scene, script, interactions, &clips)?;
    let stop = AtomicBool::new(false);
    let next = AtomicUsize::new(0);
    let count = seeds.len();
    let played = py.detach(|| {
        let (send, receive) = channel();
        std::thread::scope(|scope| {
            for _ in 0..threads.clamp(1, count.max(1)) {
                let send = send.clone();
                scope.spawn(|| play(&ready, &seeds, &next, &stop, send));
            }
            drop(send);
            let mut played: Vec<_> = (0..count).map(|_| None).collect();
            let mut over = 0;
            loop {
                match receive.recv_timeout(ASK.1) {
                    Ok((index, visited)) => {
                        played[index] = Some(visited);
                        over += 1;
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return Ok(played),
                }
                let told = Python::attach(|py| {
                    py.check_signals()?;
                    progress.as_ref().map_or(Ok(()), |tell| tell.call1(py, (over,)).map(drop))
                });
                if let Err(error) = told {
                    stop.store(true, Ordering::Relaxed);
                    return Err(error);
                }
            }
        })
    })?;
    let all = played.into_iter().flatten().collect::<Result<Vec<_>, _>>();
    json(&all.map_err(|error| visit_error(py, error))?)
}

/// Plays visits until none is left.
fn play(
    ready: &Ready,
    seeds: &[u64],
    next: &AtomicUsize,
    stop: &AtomicBool,
    send: Sender<(usize, Result<Visited, VisitError>)>,
) {
    loop {
        let index = next.fetch_add(1, Ordering::Relaxed);
        let Some(&seed) = seeds.get(index) else { return };
        let visited = ready.visit(seed).map(|mut visit| {
            while (0..ASK.0).all(|_| visit.step()) && !stop.load(Ordering::Relaxed) {}
            Visited { seed, measured: visit.measured(), happened: visit.happened().to_vec() }
        });
        if stop.load(Ordering::Relaxed) || send.send((index, visited)).is_err() {
            return;
        }
    }
}
