//! A controlled character and the ground it walks on.

use std::sync::Arc;

use ambulo_control as control;
use ambulo_control::{Areas, CrouchArea, Event, Gait, Held, Intent, JumpArea, Tuning, Wall, World};
use ambulo_rig as rig;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Pose, Transform};
use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::value_error;
use crate::feet::Feet;
use crate::model::Model;

#[derive(Clone)]
enum Ground {
    Flat(rig::Flat),
    Field(Arc<rig::HeightField>),
}

impl Ground {
    fn as_terrain(&self) -> &dyn rig::Terrain {
        match self {
            Self::Flat(flat) => flat,
            Self::Field(field) => field.as_ref(),
        }
    }
}

/// Ground to walk on; immutable.
#[pyclass(frozen, module = "ambulo")]
pub struct Terrain {
    ground: Ground,
}

#[pymethods]
impl Terrain {
    /// The same height everywhere, metres.
    #[staticmethod]
    #[pyo3(signature = (height = 0.0))]
    fn flat(height: f32) -> PyResult<Self> {
        if !height.is_finite() {
            return Err(PyValueError::new_err(format!("height must be finite, not {height}")));
        }
        Ok(Self { ground: Ground::Flat(rig::Flat(height)) })
    }

    /// Gentle hills from a seed, `size` metres a side around the origin, up to `height` metres.
    #[staticmethod]
    #[pyo3(signature = (seed = 0, size = 160.0, height = 3.0))]
    fn hills(seed: u64, size: f32, height: f32) -> PyResult<Self> {
        let field = rig::HeightField::hills(seed, size, height).map_err(value_error)?;
        Ok(Self { ground: Ground::Field(Arc::new(field)) })
    }

    /// A text grid, one row a line; `cell` metres between neighbours, heights times `scale`.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: &str, cell: f32, scale: f32) -> PyResult<Self> {
        let field = py.detach(|| rig::HeightField::from_text(text, cell, scale));
        Ok(Self { ground: Ground::Field(Arc::new(field.map_err(value_error)?)) })
    }

    /// Heights in metres at points (x, z) of two arrays of the same length.
    fn heights<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f32>,
        z: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        heights(py, self.ground.as_terrain(), x, z)
    }
}

/// Heights of a terrain at points (x, z) of two arrays of the same length.
pub fn heights<'py>(
    py: Python<'py>,
    terrain: &dyn rig::Terrain,
    x: PyReadonlyArray1<'py, f32>,
    z: PyReadonlyArray1<'py, f32>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (x, z) = (x.as_array(), z.as_array());
    if x.len() != z.len() {
        let message = format!("x has {} numbers, z {}", x.len(), z.len());
        return Err(PyValueError::new_err(message));
    }
    let heights = x.iter().zip(z).map(|(&x, &z)| terrain.height(x, z));
    Ok(Array1::from_iter(heights).into_pyarray(py))
}

/// One character under control of a model.
#[pyclass(module = "ambulo")]
pub struct Controller {
    controller: control::Controller,
    ground: Ground,
    areas: Areas,
    pose: Pose,
    global: Vec<Transform>,
    /// The layer that places the feet, where it does.
    feet: Option<Feet>,
}

fn gait_named(name: &str) -> PyResult<Gait> {
    match name {
        "walk" => Ok(Gait::Walk),
        "jog" => Ok(Gait::Jog),
        "run" => Ok(Gait::Run),
        "crouch" => Ok(Gait::Crouch),
        "auto" => Ok(Gait::Auto),
        _ => {
            let expected = "walk, jog, run, crouch or auto";
            let message = format!("gait '{name}' is not known; expected {expected}");
            Err(PyValueError::new_err(message))
        }
    }
}

fn event_text(event: Event) -> String {
    match event {
        Event::Held(Held::Time) => "held: dt is negative or not finite".into(),
        Event::Held(Held::Intent) => "held: the intent has a number that cannot be used".into(),
        Event::Held(Held::Terrain) => "held: the terrain gave a height that is not finite".into(),
        Event::Held(Held::Network) => "held: the network's answer is not a body".into(),
        Event::Skipped(seconds) => format!("skipped: {seconds} s"),
    }
}

fn rows<const N: usize>(rows: impl ExactSizeIterator<Item = [f32; N]>) -> Array2<f32> {
    let count = rows.len();
    let numbers = rows.flatten().collect();
    Array2::from_shape_vec((count, N), numbers).expect("N numbers a row")
}

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (model, *, terrain = None, start = (0.0, 0.0), facing = 0.0, responsive = false, tuning = None, place_feet = true))]
    fn new(
        model: &Model,
        terrain: Option<&Terrain>,
        start: (f32, f32),
        facing: f32,
        responsive: bool,
        tuning: Option<&str>,
        place_feet: bool,
    ) -> PyResult<Self> {
        let model = control::Model::new(model.bundle.clone()).map_err(value_error)?;
        let ground = terrain.map_or(Ground::Flat(rig::Flat(0.0)), |t| t.ground.clone());
        let areas = Areas::default();
        let tuning = match tuning {
            Some(json) => serde_json::from_str(json)
                .map_err(|error| PyValueError::new_err(format!("tuning: {error}")))?,
            None => model.tuning(),
        };
        let mut tuning: Tuning = if responsive { tuning.responsive() } else { tuning };
        let placed = place_feet && tuning.hold_feet && tuning.is_valid();
        let feet = if placed { Feet::new(&model, &tuning) } else { None };
        // The layer does it on the pose handed out; what is not a person keeps the controller's.
        tuning.hold_feet &= feet.is_none();
        let world = World { terrain: ground.as_terrain(), areas: &areas };
        let start = Vec2::new(start.0, start.1);
        let pose = model.skeleton().rest_pose();
        let global = vec![Transform::IDENTITY; model.skeleton().len()];
        let controller =
            control::Controller::new(model, tuning, start, facing, &world).map_err(value_error)?;
        let mut controller = Self { controller, ground, areas, pose, global, feet };
        controller.refresh(None);
        Ok(controller)
    }

    /// Walls (x1, z1, x2, z2, width), jump areas (x, y, z, radius, falloff) and crouch areas
    /// (x, z, half width, half depth, amount, falloff); metres. They replace those before.
    #[pyo3(signature = (*, walls = vec![], jumps = vec![], crouches = vec![]))]
    fn set_areas(
        &mut self,
        walls: Vec<[f32; 5]>,
        jumps: Vec<[f32; 5]>,
        crouches: Vec<[f32; 6]>,
    ) -> PyResult<()> {
        let lists = walls.iter().chain(&jumps).flatten().chain(crouches.iter().flatten());
        if lists.clone().any(|number| !number.is_finite()) {
            return Err(PyValueError::new_err("areas must be made of finite numbers"));
        }
        let wall = |[x1, z1, x2, z2, width]: [f32; 5]| Wall {
            start: Vec2::new(x1, z1),
            end: Vec2::new(x2, z2),
            width,
        };
        let jump = |[x, y, z, radius, falloff]: [f32; 5]| JumpArea {
            centre: Vec3::new(x, y, z),
            radius,
            falloff,
        };
        let crouch = |[x, z, width, depth, amount, falloff]: [f32; 6]| CrouchArea {
            centre: Vec2::new(x, z),
            half_size: Vec2::new(width, depth),
            amount,
            falloff,
        };
        self.areas = Areas {
            walls: walls.into_iter().map(wall).collect(),
            jumps: jumps.into_iter().map(jump).collect(),
            crouches: crouches.into_iter().map(crouch).collect(),
        };
        Ok(())
    }

    /// Moves on by `dt` seconds: (fixed steps that ran, what happened or None).
    #[pyo3(signature = (dt, velocity = (0.0, 0.0), *, gait = "walk", facing = None, strafe = 0.0))]
    fn step(
        &mut self,
        dt: f32,
        velocity: (f32, f32),
        gait: &str,
        facing: Option<(f32, f32)>,
        strafe: f32,
    ) -> PyResult<(u32, Option<String>)> {
        let intent = Intent {
            velocity: Vec2::new(velocity.0, velocity.1),
            facing: facing.map(|(x, z)| Vec2::new(x, z)),
            strafe,
            gait: gait_named(gait)?,
        };
        let world = World { terrain: self.ground.as_terrain(), areas: &self.areas };
        let step = self.controller.step(dt, &intent, &world);
        // What is held stays as it was shown.
        if step.steps > 0 || !matches!(step.event, Some(Event::Held(_))) {
            self.refresh(Some(dt));
        }
        Ok((step.steps, step.event.map(event_text)))
    }

    /// Global joint positions, (joints, 3) metres.
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        rows(self.global.iter().map(|t| t.translation.to_array())).into_pyarray(py)
    }

    /// Local joint rotations, (joints, 4) quaternions x, y, z, w; the root joint's in the world.
    fn rotations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        rows(self.pose.local.iter().map(|t| t.rotation.to_array())).into_pyarray(py)
    }

    /// Global tips of the bones that end without a joint, (tips, 3) metres, in skeleton order.
    fn tips<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let joints = self.controller.model().skeleton().joints().iter().zip(&self.global);
        let tips: Vec<_> = joints
            .flat_map(|(joint, t)| joint.tips.iter().map(|tip| t.transform_point(tip.as_vec3())))
            .collect();
        rows(tips.into_iter().map(|t| t.to_array())).into_pyarray(py)
    }

    /// Place of the root on the ground and its yaw: x, y, z in metres, radians.
    #[getter]
    fn root(&self) -> (f32, f32, f32, f32) {
        let root = self.controller.root();
        (root.position.x, root.position.y, root.position.z, root.yaw)
    }

    /// Left heel, left toe, right heel, right toe, 0 to 1.
    #[getter]
    fn contacts(&self) -> [f32; 4] {
        self.controller.contacts()
    }

    /// Whether the left and the right foot stand: held by the layer, else their toes in contact.
    #[getter]
    fn planted(&self) -> [bool; 2] {
        let [_, left, _, right] = self.controller.contacts();
        self.feet.as_ref().map_or([left, right].map(|toe| toe > 0.5), Feet::held)
    }

    /// Radians, [0, 2π).
    #[getter]
    fn phase(&self) -> f32 {
        self.controller.phase()
    }

    /// Shares of the gaits now: stand, walk, jog, run, crouch, jump, bump.
    #[getter]
    fn gaits(&self) -> [f32; 7] {
        self.controller.trajectory()[control::NOW].gait
    }

    /// The window around now, (120, 5): position x, y, z, direction x, z.
    fn trajectory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        let points = self.controller.trajectory().iter();
        rows(
            points
                .map(|p| [p.position.x, p.position.y, p.position.z, p.direction.x, p.direction.y]),
        )
        .into_pyarray(py)
    }
}

impl Controller {
    /// Takes over the pose, and places its feet `dt` seconds after the last one.
    fn refresh(&mut self, dt: Option<f32>) {
        let Self { controller, ground, pose, global, feet, .. } = self;
        controller.pose(pose);
        pose.to_global(controller.model().skeleton(), global);
        if let (Some(feet), Some(dt)) = (feet, dt) {
            feet.place(controller, ground.as_terrain(), dt, pose, global);
        }
    }
}

/// (J, 3) offsets in metres as a model's network draws its bones; see the crate.
#[pyfunction]
pub fn drawn_offsets<'py>(py: Python<'py>, model: &Model) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let model = control::Model::new(model.bundle.clone()).map_err(value_error)?;
    let offsets = py.detach(|| model.drawn_offsets());
    Ok(rows(offsets.into_iter().map(|offset| offset.to_array())).into_pyarray(py))
}
