//! Controllers from anyone; what can be read steers, and survives being written.

#![no_main]

use ambulo_body::Sensor;
use ambulo_pilot::{Pilot, Senses};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok((pilot, body, header)) = Pilot::from_bytes(bytes) else { return };
    let mut senses = Senses::default();
    let missing = pilot.check(&senses);
    senses.joint_angles = vec![0.0; body.driven().len()];
    senses.joint_speeds = vec![0.0; body.driven().len()];
    senses.foot_contacts = vec![false; body.legs().len()];
    let rays = pilot.sensors().iter().find_map(|sensor| match sensor {
        Sensor::GroundRays { count, .. } => Some(*count as usize),
        _ => None,
    });
    senses.ground_rays = vec![0.0; rays.unwrap_or(0)];
    pilot.check(&senses).expect("this is all that can be asked for");
    let mut commands = vec![0.0; pilot.joints()];
    let mut scratch = pilot.scratch();
    pilot.steer(&senses, &mut commands, &mut scratch);
    // Weights near the greatest number may sum to none.
    assert!(commands.iter().all(|command| command.is_nan() || (-1.0..=1.0).contains(command)));
    if missing.is_ok() {
        pilot.steer(&Senses::default(), &mut commands, &mut scratch);
    }
    let (licence, provenance) = (header.licence.as_str(), header.provenance.clone());
    let written = pilot.to_bytes(&body, header.fps, licence, provenance, header.parts.clone());
    let written = written.expect("what was read can be written");
    let (again, same, _) = Pilot::from_bytes(&written).expect("what we write is whole");
    assert!(again == pilot && same == body);
});
