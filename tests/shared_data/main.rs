//! Files of `../shared/data`, which are not part of the project: where the folder is missing, these tests are
//! reported as ignored.

mod grooms;
#[cfg(feature = "usd")]
mod usd;

use libtest_mimic::{Arguments, Completion, Trial, run};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A folder of the data.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name)
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Breaks files, by the same numbers in each run.
struct Changes(u64);

impl Default for Changes {
    fn default() -> Self {
        Self(1)
    }
}

impl Changes {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 33) as usize % most
    }

    /// A file with up to eight bytes changed. Its structure is at the end and in headers; most other bytes are numbers.
    fn of(&mut self, whole: &[u8], round: usize) -> Vec<u8> {
        let mut file = whole.to_vec();
        let near = [file.len(), 3000, 600][round % 3].min(file.len());
        for _ in 0..=self.below(8) {
            let at = file.len() - 1 - self.below(near);
            file[at] = self.below(256) as u8;
        }
        file
    }
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
