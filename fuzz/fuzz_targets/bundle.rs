//! Models from anyone; what can be read survives being written.

#![no_main]

use ambulo_net::Bundle;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(bundle) = Bundle::from_bytes(bytes) else { return };
    let written = bundle.to_bytes().expect("what was checked can be written");
    let again = Bundle::from_bytes(&written).expect("what we write is whole");
    assert_eq!(again, bundle);
    let network = bundle.network();
    let mut y = vec![0.0; network.outputs()];
    network.predict(&vec![0.5; network.inputs()], 1.0, &mut y, &mut network.scratch());
});
