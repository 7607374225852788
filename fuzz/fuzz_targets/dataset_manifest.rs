//! Manifests that people edit; what can be read is written and read again.

#![no_main]

use ambulo_dataset::Manifest;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(manifest) = Manifest::parse(text) else { return };
    let written = manifest.to_text().expect("what was read can be written");
    let again = Manifest::parse(&written).expect("what we write is whole");
    assert_eq!(again.to_text().expect("as before"), written);
});
