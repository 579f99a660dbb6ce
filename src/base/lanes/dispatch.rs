//! Which instruction sets kernels are compiled for, and which one they run on.

use fearless_simd::Level;
#[cfg(target_arch = "x86_64")]
use fearless_simd::Simd;
use std::{env, ffi::OsStr, sync::OnceLock};

/// Runs `work` with the token of the machine's instruction set bound to `simd`, compiled for that set.
///
/// Like [`fearless_simd::dispatch`], but on x86-64 for AVX-512, AVX2 and SSE2 only: kernels of sixteen
/// lanes are long where registers hold four numbers, and SSE4.2 adds nothing that they use, so
/// compiling them for it would only cost build time.
macro_rules! dispatch {
    ($level:expr, $simd:pat => $work:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(token) = level.as_avx512() {
                $crate::base::lanes::with_token!(token, $simd => $work)
            } else if let Some(token) = level.as_avx2() {
                $crate::base::lanes::with_token!(token, $simd => $work)
            } else if let Some(token) = level.as_sse2() {
                $crate::base::lanes::with_token!(token, $simd => $work)
            } else {
                unreachable!("every x86-64 has SSE2")
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            fearless_simd::dispatch!(level, $simd => $work)
        }
    }};
}

/// Runs `work` compiled for the instruction set of a token, in a function of its own where the caller is
/// compiled for less.
#[cfg(target_arch = "x86_64")]
macro_rules! with_token {
    ($token:expr, $simd:pat => $work:expr) => {{
        let token = $token;
        let $simd = token;
        fearless_simd::Simd::vectorize(
            token,
            #[inline(always)]
            || $work,
        )
    }};
}

pub(crate) use dispatch;
#[cfg(target_arch = "x86_64")]
pub(crate) use with_token;

/// Hands a closure through that is `#[inline(always)]`, which a `let` alone does not take.
///
/// Closures that a kernel calls have to be: one that the compiler leaves as a function is compiled without the kernel's
/// instruction set, and each of its operations becomes a call.
#[inline(always)]
pub(crate) const fn inlined<F>(closure: F) -> F {
    closure
}

/// The instruction set that kernels run on: the machine's best, or the one that the environment variable
/// `KERATIN_SIMD` names, read once. AVX2 and AVX-512 give the same bits. SSE2 rounds products before
/// they are added, which the others fuse.
pub(crate) fn simd_level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(|| {
        let wanted = env::var_os("KERATIN_SIMD");
        wanted.and_then(|wanted| named(&wanted)).unwrap_or_else(Level::new)
    })
}

/// The instruction set of that name, or `None` and an error where this machine or build has none.
fn named(wanted: &OsStr) -> Option<Level> {
    let known = simd_levels().find(|(name, _)| *name == wanted);
    if known.is_none() {
        let all: Vec<_> = simd_levels().map(|(name, _)| name).collect();
        tracing::error!("KERATIN_SIMD is {wanted:?}, expected one of {all:?}: ignored");
    }
    known.map(|(_, level)| level)
}

/// The instruction sets that kernels are compiled for and this machine has, with their names, best first.
pub(crate) fn simd_levels() -> impl Iterator<Item = (&'static str, Level)> {
    let best = Level::new();
    #[cfg(target_arch = "x86_64")]
    let all = [
        ("avx512", best.as_avx512().map(Simd::level)),
        ("avx2", best.as_avx2().map(Simd::level)),
        ("sse2", best.as_sse2().map(Simd::level)),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let all = [("best", Some(best))];
    all.into_iter().filter_map(|(name, level)| Some((name, level?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_sets_are_chosen_by_name() {
        for (name, level) in simd_levels() {
            let found = named(OsStr::new(name)).unwrap();
            assert_eq!(format!("{found:?}"), format!("{level:?}"), "{name}");
        }
        for none in ["", "AVX2", "sse5", "fallback"] {
            assert!(named(OsStr::new(none)).is_none(), "{none}");
        }
    }
}
