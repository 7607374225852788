//! ASF from anyone; a skeleton that can be read takes any motion without a panic.

#![no_main]

use ambulo_formats::ReadOptions;
use ambulo_formats::amc::{Asf, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(skeleton) = Asf::read(bytes) {
        let _ = read(&skeleton, include_bytes!("../seeds/amc/leg.amc"), &ReadOptions::default());
    }
});
