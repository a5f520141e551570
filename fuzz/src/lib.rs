//! One fuzzer for each reader; `dynaskin-fuzzing` has what is tried on them.

#![allow(missing_docs)] // The macro makes what libFuzzer calls.

use std::path::Path;

pub use dynaskin_fuzzing::Target;
pub use libfuzzer_sys;

/// What libFuzzer calls, for one target.
#[macro_export]
macro_rules! fuzz_reader {
    ($target:ident) => {
        use $crate::libfuzzer_sys;

        libfuzzer_sys::fuzz_target!(
            init: $crate::do_task($crate::Target::$target),
            |bytes: &[u8]| {
                $crate::Target::$target.check(bytes);
            }
        );

        libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::mutate($crate::Target::$target, data, size, max_size, seed)
        });
    };
}

/// What a fuzzer does instead where `DYNASKIN_CORPUS` says so: `write FOLDER` writes seeds and saved inputs,
/// `save FOLDER BYTES` saves the smallest.
pub fn do_task(target: Target) {
    let Ok(task) = std::env::var("DYNASKIN_CORPUS") else {
        return;
    };
    let words: Vec<&str> = task.split('\t').collect();
    let done = match words[..] {
        ["write", folder] => dynaskin_fuzzing::write(target, Path::new(folder)),
        ["save", folder, bytes] => {
            let limit = bytes.parse().unwrap_or(0);
            dynaskin_fuzzing::save_smallest(target, Path::new(folder), limit)
                .map(|(kept, all)| println!("{}: {kept} of {all} inputs", target.name()))
        }
        _ => panic!("no task `{task}`"),
    };
    done.unwrap_or_else(|error| panic!("{task}: {error}"));
    std::process::exit(0);
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
