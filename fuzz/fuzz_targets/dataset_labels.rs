//! Label files from anyone, ours and the published ones; what can be read labels a motion.

#![no_main]

use ambulo_dataset::{Given, Published};
use libfuzzer_sys::fuzz_target;

const FRAMES: usize = 200;

fuzz_target!(|text: &str| {
    if let Ok(given) = Given::parse(text) {
        let part = given.from(1.5).mirrored();
        assert!(part.steps.iter().all(|step| step.0 >= 0.0));
        assert!(part.steps(vec![], 60.0).is_sorted_by(|a, b| a.frame <= b.frame));
        assert_eq!(part.gaits(FRAMES, 60.0).len(), FRAMES);
        (0..FRAMES).for_each(|frame| {
            part.skips(frame, 60.0);
        });
    }
    let mut published = Published::default();
    // One text for all three: a line that one refuses is another's.
    published.phase = Published::parse_phase(text).unwrap_or_default();
    published.gaits = Published::parse_gaits(text).unwrap_or_default();
    published.cycles = Published::parse_footsteps(text).unwrap_or_default();
    assert!(published.cycles.iter().all(|cycle| cycle[0] < cycle[1] && cycle[1] < cycle[2]));
    for mirrored in [false, true] {
        let phase = published.from(30.0).phase(FRAMES, 60.0, 120.0, mirrored);
        assert!((0..FRAMES).all(|frame| (0.0..1.0).contains(&phase.at(frame))));
    }
});
