//! Files of `../shared/data`, which are not part of the project: where the folder is missing, these tests are
//! reported as ignored.

mod grooms;
#[cfg(feature = "usd")]
mod usd;

use libtest_mimic::{Arguments, Completion, Trial, run};
use std::path::{Path, PathBuf};

/// A folder of the data.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name)
}

/// A test that needs a folder of the data.
fn with(folder_name: &'static str, name: &str, test: fn(&Path)) -> Trial {
    Trial::ignorable_test(name, move || {
        let folder = folder(folder_name);
        if !folder.is_dir() {
            let reason = format!("no folder ../shared/data/{folder_name}");
            return Ok(Completion::ignored_with(reason));
        }
        test(&folder);
        Ok(Completion::Completed)
    })
}

fn main() -> std::process::ExitCode {
    let tests = grooms::tests();
    #[cfg(feature = "usd")]
    let tests = tests.into_iter().chain(usd::tests()).collect();
    run(&Arguments::from_args(), tests).exit_code()
}
