//! `cargo +nightly fuzz run groom`: any bytes are a groom or an error, and what is read can be
//! written and read again.
#![no_main]

use bevy_keratin::authoring::groom::{Groom, GroomCache, GroomSettings, alembic, yuksel};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: &[u8]| {
    if let Ok((cache, _)) = GroomCache::from_file(file, &GroomSettings::default()) {
        let archive = alembic::write_cache(&cache).expect("what was read can be written");
        let strict = GroomSettings { keep_strays: true, ..GroomSettings::default() };
        GroomCache::from_file(&archive, &strict).expect("what was written can be read");
    }
    let Ok((groom, _)) = Groom::from_file(file, &GroomSettings::default()) else {
        return;
    };
    assert!(groom.points().len() <= file.len());
    let archive = alembic::write(&groom).expect("what was read can be written");
    let (again, _) = alembic::read(&archive).expect("what was written can be read");
    assert_eq!(again.points(), groom.points());
    let Ok(written) = yuksel::write(&groom) else {
        return;
    };
    let (again, _) = yuksel::read(&written).expect("what was written can be read");
    assert_eq!(again.points(), groom.points());
});
