//! A bundle whose files hold any bytes is refused or becomes a description. The first byte chooses the files' names,
//! and so the family; a zero byte ends a file.
#![no_main]

use std::fs;

use actq_deploy::{Answers, Bundle, read};
use libfuzzer_sys::fuzz_target;

/// Files of each family that has text files, the network last.
const NAMES: [&[&str]; 8] = [
    &["params/deploy.yaml", "exported/policy.onnx"],
    &["params.yaml", "policy/isaaclab/policy.onnx", "policy/isaaclab/encoder.onnx"],
    &["config.yaml", "robot.xml", "models/policy.kinfer"],
    &["config.yaml", "policy.onnx"],
    &["config.json", "policy_preprocessor.json", "policy_postprocessor.json", "meta/info.json", "policy.onnx"],
    &["base.yaml", "walk/config.yaml", "walk/policy.onnx"],
    &["params/env.yaml", "io_descriptors/IO_descriptors.yaml", "exported/policy.onnx"],
    &["walker.yaml", "walker_initial_values.safetensors", "observe.onnx", "policy.onnx"],
];

fuzz_target!(|bytes: &[u8]| {
    let Some((options, rest)) = bytes.split_first() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let names = NAMES[usize::from(*options) % NAMES.len()];
    let mut parts = rest.splitn(names.len(), |byte| *byte == 0);
    for name in names {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, parts.next().unwrap_or_default()).expect("written");
    }
    let bundle = Bundle::open(folder.path()).expect("the folder is there");
    let _ = read(&bundle, true, Answers::default());
});
