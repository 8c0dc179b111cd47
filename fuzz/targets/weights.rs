//! A safetensors file is refused, or each of its tensors can be read.
#![no_main]

use actq::import::tensors::TensorFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = TensorFile::new(bytes) else { return };
    for name in file.names() {
        let tensor = file.get(&name).expect("the file has the tensor");
        let _ = tensor.values.to_f32();
    }
});
