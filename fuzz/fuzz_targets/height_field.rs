//! Height maps from anyone; whatever can be read has finite heights everywhere.

#![no_main]

use ambulo_rig::{HeightField, Terrain};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(field) = HeightField::from_text(text, 0.04, 0.03) else { return };
    for place in [0.0, -0.01, 0.05, 1e9, f32::NAN] {
        assert!(field.height(place, -place).is_finite());
    }
});
