//! Models from anyone; what can be read survives being written, in either precision.

#![no_main]

use ambulo_net::{Bundle, Precision};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(bundle) = Bundle::from_bytes(bytes) else { return };
    let written = bundle.to_bytes(bundle.precision()).expect("what was read can be written");
    let again = Bundle::from_bytes(&written).expect("what we write is whole");
    assert_eq!(again, bundle);
    // Refused where a number is beyond half precision; otherwise rounding once is enough.
    if let Ok(half) = bundle.to_bytes(Precision::Half) {
        let rounded = Bundle::from_bytes(&half).expect("what we write is whole");
        assert_eq!(rounded.to_bytes(Precision::Half).expect("it is rounded"), half);
    }
    let network = bundle.network();
    let mut y = vec![0.0; network.outputs()];
    network.predict(&vec![0.5; network.inputs()], 1.0, &mut y, &mut network.scratch());
});
