//! A walker whose steps, gait and ground are known, and folders to build data sets of it in.
#![allow(dead_code, reason = "each test program uses a part")]

use std::collections::HashMap;
use std::f64::consts::PI;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use ambulo_dataset::build::{Built, build};
use ambulo_dataset::prepare::{LabelFiles, Ready, Setup};
use ambulo_dataset::{DatasetError, Loaded, Manifest, RoleNames, plan};
use ambulo_features::Layout;
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Joint, Roles, Skeleton};

pub const FPS: f64 = 60.0;
/// Ankle and ball of the foot over the ground while they stand.
pub const HEEL: f64 = 0.09;
pub const TOE: f64 = 0.02;
const HALF_WIDTH: f64 = 0.1;
const HIPS: f64 = 0.93;
/// Joints whose places are animated: hips, and both ankles.
const MOVING: [usize; 3] = [0, 3, 7];
pub const JOINTS: usize = 13;

pub fn skeleton() -> Skeleton {
    let joint = |(name, parent, offset): (&str, Option<usize>, [f64; 3])| Joint {
        name: name.into(),
        parent,
        offset: DVec3::from_array(offset),
        tips: vec![],
    };
    let joints = [
        ("Hips", None, [0.0, 0.0, 0.0]),
        ("LeftUpLeg", Some(0), [HALF_WIDTH, -0.05, 0.0]),
        ("LeftLeg", Some(1), [0.0, -0.42, 0.02]),
        ("LeftFoot", Some(2), [0.0, -0.40, -0.02]),
        ("LeftToeBase", Some(3), [0.0, TOE - HEEL, 0.14]),
        ("RightUpLeg", Some(0), [-HALF_WIDTH, -0.05, 0.0]),
        ("RightLeg", Some(5), [0.0, -0.42, 0.02]),
        ("RightFoot", Some(6), [0.0, -0.40, -0.02]),
        ("RightToeBase", Some(7), [0.0, TOE - HEEL, 0.14]),
        ("Spine", Some(0), [0.0, 0.25, 0.0]),
        ("LeftArm", Some(9), [0.2, 0.25, 0.0]),
        ("RightArm", Some(9), [-0.2, 0.25, 0.0]),
        ("Head", Some(9), [0.0, 0.45, 0.03]),
    ];
    Skeleton::new(joints.map(joint).into()).unwrap()
}

/// Walks in a circle, or straight ahead, on any ground; the right foot comes down first.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    pub seconds: f64,
    /// m/s over the ground.
    pub speed: f64,
    /// Steps a second; 0 stands still.
    pub cadence: f64,
    /// Share of a cycle that a foot is down.
    pub duty: f64,
    /// Radians from the direction of travel to the facing, positive to the left.
    pub facing: f64,
    /// Radians a second, positive to the left.
    pub turn: f64,
    /// Direction of travel at the start.
    pub heading: f64,
    /// First step, seconds.
    pub first: f64,
    /// Hips' height over the ground.
    pub hips: f64,
    /// Height of the ground.
    pub ground: fn(f64, f64) -> f64,
}

pub const WALK: Walker = Walker {
    seconds: 8.0,
    speed: 1.3,
    cadence: 1.9,
    duty: 0.62,
    facing: 0.0,
    turn: 0.0,
    heading: 0.4,
    first: 0.3,
    hips: HIPS,
    ground: |_, _| 0.0,
};
pub const JOG: Walker = Walker { speed: 2.7, cadence: 2.7, duty: 0.36, ..WALK };
pub const RUN: Walker = Walker { speed: 4.6, cadence: 3.0, duty: 0.3, ..WALK };
pub const STAND: Walker = Walker { speed: 0.0, cadence: 0.0, ..WALK };
pub const CROUCH: Walker = Walker { speed: 0.7, hips: 0.6, ..WALK };
pub const BACKWARD: Walker = Walker { speed: 0.9, facing: PI, ..WALK };
pub const TO_THE_LEFT: Walker = Walker { speed: 0.8, facing: -PI / 2.0, ..WALK };
pub const ROUGH: Walker = Walker {
    ground: |x, z| 0.12 * (1.3 * x).sin() + 0.2 * (0.9 * z + 1.0).sin() + 0.03 * (5.0 * z).cos(),
    ..WALK
};

impl Walker {
    /// Direction of travel.
    fn along(&self, time: f64) -> f64 {
        self.heading + self.turn * time
    }

    pub fn yaw(&self, time: f64) -> f64 {
        self.along(time) + self.facing
    }

    /// Where the hips are, on the ground plane.
    pub fn path(&self, time: f64) -> DVec3 {
        if self.turn.abs() < 1e-9 {
            return DVec3::new(self.heading.sin(), 0.0, self.heading.cos()) * self.speed * time;
        }
        let side = |at: f64| DVec3::new(-at.cos(), 0.0, at.sin());
        (side(self.along(time)) - side(self.along(0.0))) * (self.speed / self.turn)
    }

    /// Seconds of the `index`-th step; even ones are the right foot's.
    pub fn step(&self, index: i64) -> f64 {
        self.first + index as f64 / self.cadence
    }

    /// Cycles at a time: 0 as the right foot comes down first.
    pub fn cycles(&self, time: f64) -> f64 {
        (time - self.first) * self.cadence / 2.0
    }

    /// The step that a foot (0 left, 1 right) made last, and the time since.
    fn last(&self, side: i64, time: f64) -> (i64, f64) {
        let offset = 1 - side;
        let made = ((time - self.step(offset)) * self.cadence / 2.0).floor() as i64;
        let index = offset + 2 * made;
        (index, time - self.step(index))
    }

    fn stance(&self) -> f64 {
        2.0 * self.duty / self.cadence
    }

    /// Whether a foot is down.
    pub fn down(&self, side: usize, time: f64) -> bool {
        self.cadence == 0.0 || self.last(side as i64, time).1 < self.stance()
    }

    /// Where a foot stands after its `index`-th step.
    fn print(&self, side: i64, index: i64) -> DVec3 {
        let middle = if index == i64::MAX { 0.0 } else { self.step(index) + 0.5 * self.stance() };
        let beside = DVec3::X * (HALF_WIDTH * (1.0 - 2.0 * side as f64));
        let place = self.path(middle) + DQuat::from_rotation_y(self.yaw(middle)) * beside;
        DVec3::new(place.x, (self.ground)(place.x, place.z) + HEEL, place.z)
    }

    fn ankle(&self, side: i64, time: f64) -> DVec3 {
        if self.cadence == 0.0 {
            return self.print(side, i64::MAX);
        }
        let (index, since) = self.last(side, time);
        let here = self.print(side, index);
        if since < self.stance() {
            return here;
        }
        let share = (since - self.stance()) / (2.0 / self.cadence - self.stance());
        let eased = share * share * (3.0 - 2.0 * share);
        here.lerp(self.print(side, index + 2), eased) + DVec3::Y * 0.12 * (PI * share).sin()
    }

    pub fn clip(&self) -> Clip {
        let skeleton = skeleton();
        let knees = [[0, 1, 2], [0, 5, 6]].map(|chain| {
            let offsets = chain.map(|joint: usize| skeleton.joints()[joint].offset);
            offsets[1] + offsets[2]
        });
        let (mut translations, mut rotations) = (vec![], vec![]);
        for frame in 0..(self.seconds * FPS) as usize {
            let time = frame as f64 / FPS;
            let turn = DQuat::from_rotation_y(self.yaw(time));
            let place = self.path(time);
            let height = (self.ground)(place.x, place.z) + self.hips;
            let hips = DVec3::new(place.x, height, place.z);
            translations.push(hips);
            for side in 0..2 {
                let seen = turn.inverse() * (self.ankle(side, time) - hips);
                translations.push(seen - knees[side as usize]);
            }
            rotations.push(turn);
            rotations.extend([DQuat::IDENTITY; JOINTS - 1]);
        }
        Clip::new(skeleton, 1.0 / FPS, MOVING.into(), translations, rotations).unwrap()
    }
}

pub fn roles() -> RoleNames {
    RoleNames::of(&Roles::by_name(&skeleton()), &skeleton()).unwrap()
}

pub fn setup(layout: &str) -> Setup {
    Setup {
        layout: Layout::named(layout, JOINTS).unwrap(),
        skeleton: skeleton(),
        roles: roles(),
        drop: vec![],
        foot_heights: [HEEL, TOE, HEEL, TOE].map(|height| height as f32),
        contacts: Default::default(),
        gaits: Default::default(),
    }
}

pub fn ready(clip: &Clip, mirror: bool, files: &LabelFiles) -> Ready {
    let setup = setup("ambulo");
    let fitted = setup.fit(clip, "ambulo", None, None).unwrap();
    setup.label(&fitted, clip.fps(), mirror, files).unwrap()
}

/// A folder of its own that goes away with it, and clips that its files stand for.
pub struct Folder {
    pub path: PathBuf,
    clips: HashMap<String, Clip>,
}

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("ambulo-dataset-{}-{count}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(path.join("captures")).unwrap();
        Self { path, clips: HashMap::new() }
    }

    pub fn with(walkers: &[(&str, Walker)]) -> Self {
        let mut folder = Self::new();
        walkers.iter().for_each(|(name, walker)| folder.add(name, walker.clip()));
        folder
    }

    /// A file whose bytes only tell that clips differ; `load` knows what it stands for.
    pub fn add(&mut self, name: &str, clip: Clip) {
        let (frames, last) = (clip.frames(), clip.translations(clip.frames() - 1).to_vec());
        std::fs::write(self.file(name), format!("{frames} {last:?}")).unwrap();
        self.clips.insert(name.into(), clip);
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join("captures").join(format!("{name}.bvh"))
    }

    pub fn load(&self, path: &Path) -> Result<Loaded, String> {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let clip = self.clips.get(name).ok_or("line 3: expected HIERARCHY")?.clone();
        Ok(Loaded { clip, axes: Ok("ambulo".into()) })
    }

    pub fn files(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.path.join("captures")).unwrap();
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }

    pub fn plan(&self, settings: &Manifest) -> Result<plan::Planned, DatasetError> {
        plan::plan(&self.files(), &self.path, settings, &|p: &Path| self.load(p), 2, &|_| true)
    }

    pub fn manifest(&self, settings: &Manifest) -> Manifest {
        self.plan(settings).unwrap().manifest
    }

    pub fn build(&self, manifest: &Manifest, threads: usize) -> Result<Built, DatasetError> {
        build(&self.path, manifest, &|p: &Path| self.load(p), threads, &|_| true)
    }

    /// Every file below the folder that a build writes, with a fingerprint of its bytes.
    pub fn bytes(&self) -> Vec<(String, u64)> {
        let mut found = vec![];
        for below in ["", "shards", "labels"] {
            let Ok(entries) = std::fs::read_dir(self.path.join(below)) else { continue };
            for path in entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
                let name = path.strip_prefix(&self.path).unwrap().to_str().unwrap().to_owned();
                let mut hasher = DefaultHasher::new();
                std::fs::read(&path).unwrap().hash(&mut hasher);
                found.push((name, hasher.finish()));
            }
        }
        found.sort();
        found
    }

    /// Rows of a shard.
    pub fn rows(&self, shard: &str) -> Vec<Vec<f32>> {
        let bytes = std::fs::read(self.path.join(format!("shards/{shard}.npy"))).unwrap();
        let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8(bytes[10..header].into()).unwrap();
        let shape = text.split('(').nth(1).unwrap().split(')').next().unwrap();
        let width: usize = shape.split(',').nth(1).unwrap().trim().parse().unwrap();
        let number = |four: &[u8]| f32::from_le_bytes(four.try_into().unwrap());
        let numbers: Vec<f32> = bytes[header..].chunks(4).map(number).collect();
        numbers.chunks(width).map(<[f32]>::to_vec).collect()
    }

    pub fn index(&self) -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(self.path.join("dataset.json")).unwrap()).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Distance on the circle, cycles.
pub fn apart(a: f64, b: f64) -> f64 {
    let off = a - b;
    (off - off.round()).abs()
}
