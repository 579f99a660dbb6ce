//! Which instruction sets kernels are compiled for.

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
                $crate::math::lanes::with_token!(token, $simd => $work)
            } else if let Some(token) = level.as_avx2() {
                $crate::math::lanes::with_token!(token, $simd => $work)
            } else if let Some(token) = level.as_sse2() {
                $crate::math::lanes::with_token!(token, $simd => $work)
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

pub(crate) use {dispatch, with_token};
