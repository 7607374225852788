//! What a creature is: parts, hinge joints with motors, sensors.
//!
//! A [`Description`] is a creature file as it is written (`schema/creature.schema.json`); a [`Body`]
//! is one that was checked, with everything that follows from it: which joints are driven, which
//! parts are legs and feet, masses and sizes. The rules of the mapping are those of Gegendorfer,
//! "Using Neuroevolution for Physics-Based Character Animation in Two Dimensions" (TU Wien, 2017),
//! section 4.2.1.
//!
//! Metres, kilograms, seconds, radians; x to the right, y up, angles counter-clockwise.

mod body;
mod check;
mod description;
mod morphology;
mod shape;

pub use body::{Body, Leg};
pub use check::{BodyError, MOST_PARTS, Problem};
pub use description::{Description, FORMAT_VERSION, Joint, Part, Sensor, Shape, Tag};
pub use morphology::{Morphology, MorphologyError};
