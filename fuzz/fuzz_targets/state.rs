#![no_main]

dynaskin_fuzz::fuzz_reader!(State);
