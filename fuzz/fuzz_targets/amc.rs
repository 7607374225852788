//! AMC from anyone, on a skeleton of ours.

#![no_main]

use std::sync::LazyLock;

use ambulo_formats::ReadOptions;
use ambulo_formats::amc::{Asf, read};
use libfuzzer_sys::fuzz_target;

static SKELETON: LazyLock<Asf> =
    LazyLock::new(|| Asf::read(include_bytes!("../seeds/asf/leg.asf")).expect("the seed is whole"));

fuzz_target!(|bytes: &[u8]| {
    for repair in [false, true] {
        let _ = read(&SKELETON, bytes, &ReadOptions { repair, ..ReadOptions::default() });
    }
});
