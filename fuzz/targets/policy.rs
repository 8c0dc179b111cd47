//! policy.json beside a file of small tensors is refused or becomes a policy.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use actq::policy::Policy;
use libfuzzer_sys::fuzz_target;
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

/// Values of observation, iterate and layers, all equal, so that random ops fit together.
const LEN: usize = 4;

static WEIGHTS: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let bytes: Vec<u8> = (0..4 * LEN * LEN).flat_map(|i| (0.1 * i as f32 - 1.0).to_le_bytes()).collect();
    let tensor = |shape: &[usize]| {
        let len = 4 * shape.iter().product::<usize>();
        TensorView::new(Dtype::F32, shape.to_vec(), &bytes[..len]).expect("the bytes fit the shape")
    };
    let tensors = [
        ("w", tensor(&[LEN, LEN])),
        ("b", tensor(&[LEN])),
        ("i", tensor(&[4 * LEN, LEN])),
        ("time.freq", tensor(&[LEN / 2])),
    ];
    serialize(tensors, None).expect("the names differ")
});

fuzz_target!(|json: &[u8]| {
    let here = Path::new("fuzzed");
    let _ = Policy::of_files(here, [here, here], json, &WEIGHTS);
});
