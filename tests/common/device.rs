//! Tests that need a Vulkan device: where there is none they are reported as ignored, with the reason, and
//! fail if `KERATIN_DEMAND_DEVICE` is set.
#![allow(dead_code, unused_macros, reason = "each test binary uses its own part")]

use crate::offscreen::has_adapter;
use libtest_mimic::{Arguments, Completion, Trial, run};
use std::sync::RwLock;

const NO_DEVICE: &str = "no Vulkan driver; Debian's mesa-vulkan-drivers draws in software";

/// Read by tests that run beside each other, written by one that runs alone.
static MACHINE: RwLock<()> = RwLock::new(());

/// A test that needs a device.
pub fn device(name: &str, test: fn()) -> Trial {
    on_device(name, move || {
        let _beside = MACHINE.read();
        test();
    })
}

/// A test that needs a device and measures time, or destroys its device, which may crash a driver that another test is
/// using: no other of its program runs meanwhile.
pub fn alone(name: &str, test: fn()) -> Trial {
    on_device(name, move || {
        let _alone = MACHINE.write();
        test();
    })
}

fn on_device(name: &str, test: impl FnOnce() + Send + 'static) -> Trial {
    Trial::ignorable_test(name, move || {
        if has_adapter() {
            test();
            Ok(Completion::Completed)
        } else if std::env::var_os("KERATIN_DEMAND_DEVICE").is_some() {
            Err(format!("KERATIN_DEMAND_DEVICE is set, but there is {NO_DEVICE}").into())
        } else {
            Ok(Completion::ignored_with(NO_DEVICE))
        }
    })
}

/// A test that needs a device and runs only if asked for by `--ignored`.
pub fn on_request(name: &str, test: fn()) -> Trial {
    device(name, test).with_ignored_flag(true)
}

/// A test that needs no device.
pub fn anywhere(name: &str, test: fn()) -> Trial {
    Trial::test(name, move || {
        let _beside = MACHINE.read();
        test();
        Ok(())
    })
}

pub fn run_all(tests: Vec<Trial>) -> std::process::ExitCode {
    run(&Arguments::from_args(), tests).exit_code()
}

/// `main` of a test program: modules, and in each its tests by their needs, which are the functions above.
macro_rules! tests {
    ($($module:ident { $($needs:ident: $($test:ident),+;)+ })+) => {
        fn main() -> std::process::ExitCode {
            device::run_all(vec![$($($(device::$needs(
                concat!(stringify!($module), "::", stringify!($test)),
                $module::$test,
            )),+),+),+])
        }
    };
}
#[allow(unused_imports, reason = "as above")]
pub(crate) use tests;
