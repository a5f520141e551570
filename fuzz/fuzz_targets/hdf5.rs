#![no_main]

dynaskin_fuzz::fuzz_reader!(Hdf5);
