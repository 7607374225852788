//! Keys from anyone, with the file beside that they may name; what can be read survives being
//! written.

#![no_main]

use ambulo_formats::keys::{read, write};
use libfuzzer_sys::fuzz_target;

/// Divides the file from the one beside it.
const BESIDE: &[u8] = b"\n---\n";

fuzz_target!(|bytes: &[u8]| {
    let cut = bytes.windows(BESIDE.len()).position(|window| window == BESIDE);
    let (own, other) = match cut {
        Some(at) => (&bytes[..at], Some(&bytes[at + BESIDE.len()..])),
        None => (bytes, None),
    };
    let mut beside = |_: &str| other.map(<[u8]>::to_vec).ok_or_else(|| "none".to_owned());
    let Ok(keys) = read(own, &mut beside) else { return };
    // A long clip says no more than a short one, and takes its time.
    if keys.duration() * keys.fps() < 1000.0 {
        let frames = keys.sample().clip.frames();
        assert_eq!(frames, (keys.duration() * keys.fps() + 1e-6) as usize + 1);
    }
    let written = write(&keys);
    let again = read(&written, &mut beside).expect("what we write is whole");
    assert_eq!(again, keys, "what is written says the same");
    assert_eq!(write(&again), written, "what is written twice is the same");
});
