//! A saved controller: what a creature senses in, what its motors shall do out.
//!
//! No physics here: give it angles, get motor speeds, whatever moves the body. The encoding is that
//! of Gegendorfer, "Using Neuroevolution for Physics-Based Character Animation in Two Dimensions"
//! (TU Wien, 2017), section 4.2.2, whose versions 1.0 to 2.0 are settings; other kinds of controllers
//! beside the network stand in [`Kind`]. [`Pilot`] steers one creature, [`Pilots`] one in each lane,
//! to the same bits.

mod file;
mod make;
mod pilot;
mod pilots;
mod settings;

pub use file::{CreatureReference, PilotFileError};
pub use pilot::{Pilot, PilotError, PilotScratch, Senses};
pub use pilots::{Felt, Pilots};
pub use settings::{Kind, Scaling, Settings, Version};
