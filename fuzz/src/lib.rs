//! One fuzzer for each reader; `dynaskin-fuzzing` has what is tried on them.

#![allow(missing_docs)] // The macro makes what libFuzzer calls.

pub use dynaskin_fuzzing::Target;
pub use libfuzzer_sys;

/// What libFuzzer calls, for one target.
#[macro_export]
macro_rules! fuzz_reader {
    ($target:ident) => {
        use $crate::libfuzzer_sys;

        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
            $crate::Target::$target.check(bytes);
        });

        libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::mutate($crate::Target::$target, data, size, max_size, seed)
        });
    };
}

/// Changes `data[..size]` in place; gives the new size.
pub fn mutate(target: Target, data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mut raw = |bytes: &mut Vec<u8>| {
        let length = bytes.len();
        // Room to grow.
        bytes.resize(length + 64, 0);
        let room = bytes.len();
        let changed = libfuzzer_sys::fuzzer_mutate(bytes, length, room);
        bytes.truncate(changed);
    };
    let mutated = target.mutated(&data[..size], u64::from(seed), &mut raw);
    let length = mutated.len().min(max_size).min(data.len());
    data[..length].copy_from_slice(&mutated[..length]);
    length
}
