//! The scene and the interactions that ship, on the body of a model.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ambulo_control::Model;
use ambulo_formats::ReadOptions;
use ambulo_formats::files::read_path;
use ambulo_net::Bundle;
use ambulo_rig::Clip;
use ambulo_scene::{Body, Interaction, Moves, Scene};

pub struct Playground {
    pub scene: Scene,
    pub model: Model,
    pub body: Arc<Body>,
    pub moves: Arc<Moves>,
}

pub fn starters() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../starters")
}

pub fn playground() -> Scene {
    let text = std::fs::read_to_string(starters().join("scenes/playground.toml")).unwrap();
    Scene::parse(&text).unwrap_or_else(|error| panic!("playground.toml:\n{error}"))
}

pub fn model() -> Model {
    let bytes = std::fs::read(starters().join("human.safetensors")).unwrap();
    Model::new(Arc::new(Bundle::from_bytes(&bytes).unwrap())).unwrap()
}

pub fn interactions() -> Vec<(String, Interaction)> {
    let files = std::fs::read_dir(starters().join("interactions")).unwrap();
    let read = files.map(|file| {
        let file = file.unwrap();
        let name = file.file_name().into_string().unwrap();
        let text = std::fs::read_to_string(file.path()).unwrap();
        let one = Interaction::parse(&text).unwrap_or_else(|error| panic!("{name}:\n{error}"));
        (name, one)
    });
    read.collect()
}

impl Playground {
    pub fn read(model: &Model) -> Self {
        let scene = playground();
        let body = Arc::new(Body::new(model).unwrap());
        let all = interactions();
        let mut clips: HashMap<String, Clip> = HashMap::new();
        for file in all.iter().filter_map(|(_, one)| one.clip.file.clone()) {
            let path = starters().join("clips").join(&file);
            let read = read_path(&path, &ReadOptions::default());
            clips.insert(file, read.unwrap_or_else(|error| panic!("{error}")).clip);
        }
        let moves = Moves::new(&body, &scene, &all, |file| clips.get(file)).unwrap();
        Self { scene, model: model.clone(), body, moves: Arc::new(moves) }
    }
}
