//! An ONNX file is refused or imported, and an imported file is a valid policy.
#![no_main]

use std::path::Path;

use actq_onnx::{ImportOptions, import_bytes};
use actq::policy::Policy;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let here = Path::new("no such folder");
    if let Ok(imported) = import_bytes(bytes.to_vec(), here, "fuzzed", &ImportOptions::default()) {
        let [json, weights] = imported.source.files().expect("an imported file can be written");
        Policy::of_files(here, [here, here], &json, &weights).expect("an imported file is a valid policy");
    }
});
