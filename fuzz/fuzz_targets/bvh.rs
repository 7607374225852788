//! BVH from anyone; what can be read survives being written.

#![no_main]

use ambulo_formats::bvh::{WriteOptions, read, write};
use ambulo_formats::detect::detect;
use ambulo_formats::{Positions, ReadOptions};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for repair in [false, true] {
        let options = ReadOptions { repair, ..ReadOptions::default() };
        let Ok(bvh) = read(bytes, &options) else { continue };
        detect(&bvh.clip, Positions::Replace);
        let written = write(&bvh.clip, &WriteOptions { dialect: Some(bvh.dialect) });
        let again = read(&written.bytes, &ReadOptions::default()).expect("what we write is whole");
        assert_eq!(again.notes, [], "what we write is plain");
        let second = write(&again.clip, &WriteOptions { dialect: Some(again.dialect) });
        assert_eq!(
            String::from_utf8_lossy(&second.bytes),
            String::from_utf8_lossy(&written.bytes),
            "what is written twice is the same"
        );
    }
});
