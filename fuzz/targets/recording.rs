//! A recording is refused or read. The first byte selects the file's extension.
#![no_main]

use std::io::Write as _;

use actq::data::{Dataset, Sizes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((&ending, content)) = bytes.split_first() else { return };
    let ending = [".npy", ".npz", ".safetensors"][usize::from(ending) % 3];
    let mut file = tempfile::Builder::new().suffix(ending).tempfile().expect("a file for the recording");
    file.write_all(content).expect("the recording is written");
    let sizes = Sizes { obs: 2, noise: 0, out: 2, state: 1 };
    if let Ok(dataset) = Dataset::load(file.path(), sizes) {
        assert!(dataset.frames() > 0);
    }
});
