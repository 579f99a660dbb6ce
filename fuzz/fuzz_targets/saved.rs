//! `cargo +nightly fuzz run saved`: any bytes are a hairdo, a snapshot, or an error.
#![no_main]

use bevy_keratin::{HairSnapshot, HairWorldSnapshot, prelude::*};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: &[u8]| {
    if let Ok(hairdo) = Hairdo::from_bytes(file) {
        Hairdo::from_bytes(&hairdo.to_bytes()).expect("what was written can be read");
    }
    if let Ok(snapshot) = HairSnapshot::from_bytes(file) {
        HairSnapshot::from_bytes(&snapshot.to_bytes()).expect("what was written can be read");
    }
    let _ = HairWorldSnapshot::from_bytes(file);
});
