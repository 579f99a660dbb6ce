//! The crate's only unsafe code by itself, for Miri: `cargo +nightly miri test` in this folder.

#[cfg(test)]
#[path = "../../../src/base/parallel/prefetch.rs"]
mod prefetch;

#[cfg(test)]
mod tests {
    use super::prefetch::prefetch;

    #[test]
    fn addresses_are_within_what_is_prefetched() {
        for len in [0, 1, 15, 16, 17, 64, 65, 1000] {
            let bytes = vec![0_u8; len + 7];
            prefetch(&bytes[7..]);
            prefetch(&vec![0.0_f32; len]);
            prefetch(&vec![[0.0_f64; 3]; len]);
            prefetch(&vec![(); len]);
        }
    }
}
