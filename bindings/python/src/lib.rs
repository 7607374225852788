//! The Python package's native module: a shell around the crates, no logic of its own.

mod character;
mod creature;
mod dataset;
mod errors;
mod feet;
mod model;
mod motion;
mod scene;

use pyo3::prelude::*;

/// Ambulo's Rust core.
#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::character::{Controller, Terrain, drawn_offsets};
    #[pymodule_export]
    use crate::creature::{Arena, Creature, CreatureController, Recorded, Search, creature_tasks};
    #[pymodule_export]
    use crate::dataset::{
        clip_rows, dataset_build, dataset_categories, dataset_check, dataset_plan,
    };
    #[pymodule_export]
    use crate::errors::{CreatureFileError, MotionFileError, SceneFileError};
    #[pymodule_export]
    use crate::model::{Model, joint_rotations, layout, phase_shares};
    #[pymodule_export]
    use crate::motion::{Clip, motion_axes, read_motion, write_motion};
    #[pymodule_export]
    use crate::scene::{
        Visit, document_place, read_interaction, read_scene, read_script, visit_seeds,
    };
}
