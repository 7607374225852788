//! A visit to a scene: a script is played, and what is measured on the way.

mod driver;
mod measure;
mod script;

use std::sync::Arc;

use ambulo_control::{ControlError, Model};
use ambulo_rig::glam::{Vec2, Vec3};
use serde::Serialize;

use crate::actor::{Actor, Body, Moves, Told};
use crate::reading::FileError;
use crate::{Physics, STEP, Scene};

use driver::Driver;
use measure::Measure;
pub use measure::Measured;
pub use script::{Interruptions, SCRIPT_FORMAT, Script, Task};

/// Radius and height of the character's capsule, metres.
const CAPSULE: [f32; 2] = [0.2, 1.75];
/// Seconds after which a visit is given up.
const LONGEST: f32 = 3600.0;

/// Why a visit cannot begin.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum VisitError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Control(#[from] ControlError),
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Happened {
    /// Seconds since the start.
    pub time: f32,
    /// `walks`, `enters`, `holds`, `exits`, `ended`, `broken`, `gave up: …`.
    pub what: String,
    /// Name of the object.
    pub object: String,
    /// The interaction's file.
    pub interaction: String,
}

/// A visit that is under way, at 60 frames a second.
pub struct Visit {
    scene: Scene,
    physics: Physics,
    actor: Actor,
    driver: Driver,
    measure: Measure,
    frames: u64,
    happened: Vec<Happened>,
}

impl Visit {
    /// A character at the scene's start. A seed other than 0 starts it a little elsewhere, and breaks
    /// interactions off at random as the script allows.
    ///
    /// # Errors
    /// A script that does not fit the scene, a start without ground.
    pub fn new(
        scene: &Scene,
        script: &Script,
        model: &Model,
        body: Arc<Body>,
        moves: Arc<Moves>,
        seed: u64,
    ) -> Result<Self, VisitError> {
        script.check_against(scene)?;
        let mut physics = Physics::new(scene)?;
        let mut driver = Driver::new(script, scene, &moves, seed);
        let (off, turn) = driver.start();
        let place = Vec2::from(scene.spawn.place) + off;
        let yaw = scene.spawn.yaw + turn;
        let [radius, height] = CAPSULE;
        let at = Vec3::new(place.x, 0.0, place.y);
        physics.place_character(at, radius, height).expect("a place within the scene");
        let actor = Actor::new(model, body, moves, place, yaw, &physics)?;
        let measure = Measure::new(&actor, scene);
        let (scene, happened) = (scene.clone(), vec![]);
        Ok(Self { scene, physics, actor, driver, measure, frames: 0, happened })
    }

    /// One frame; false when the script is over (or an hour has passed).
    pub fn step(&mut self) -> bool {
        if self.driver.is_over() || self.time() > LONGEST {
            return false;
        }
        let wish = self.driver.wish(&self.actor, &self.physics, STEP);
        let acted = self.actor.step(STEP, &wish, &mut self.physics);
        self.physics.step(STEP).expect("a good step");
        self.actor.pose(STEP, &mut self.physics);
        self.frames += 1;
        self.measure.frame(&self.actor, &self.physics, acted.told);
        if let Some(told) = acted.told {
            self.tell(told);
        }
        self.driver.hear(acted.told);
        true
    }

    fn tell(&mut self, told: Told) {
        let about = self.actor.about().map(|about| (about.object, about.which));
        let Some((object, which)) = about.or(self.driver.about()) else { return };
        let what = match told {
            Told::Walks => "walks".into(),
            Told::Enters => "enters".into(),
            Told::Holds => "holds".into(),
            Told::Exits => "exits".into(),
            Told::Ended => "ended".into(),
            Told::Broken => "broken".into(),
            Told::GaveUp(why) => format!("gave up: {why:?}"),
        };
        let object = self.scene.objects[object].name.clone();
        let interaction = self.actor.moves().all()[which].file.clone();
        self.happened.push(Happened { time: self.time(), what, object, interaction });
    }

    /// Seconds since the start.
    pub fn time(&self) -> f32 {
        self.frames as f32 * STEP
    }

    /// The character.
    pub fn actor(&self) -> &Actor {
        &self.actor
    }

    /// The objects.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What happened so far.
    pub fn happened(&self) -> &[Happened] {
        &self.happened
    }

    /// What was measured so far.
    pub fn measured(&self) -> Measured {
        self.measure.result(self.time(), self.driver.undone())
    }
}
