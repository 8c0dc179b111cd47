//! An image, with any checksum or the right one, is refused, or its head runs a step.
#![no_main]

use std::task::Poll;

use actq::runtime::{ImageBuffer, with_head};
use actq_kernels::image::seal;
use actq_kernels::cost::Rates;
use libfuzzer_sys::fuzz_target;

/// Instructions of the longest step to run.
const INSTRUCTIONS: u64 = 10_000_000;
const SCRATCH_WORDS: usize = 1 << 20;

fn run(bytes: &[u8]) {
    let buffer = ImageBuffer::new(bytes);
    let Ok(image) = buffer.image("fuzzed".as_ref()) else { return };
    if image.scratch_words() > SCRATCH_WORDS || Rates::M4F.of_step(&image).instructions > INSTRUCTIONS {
        return;
    }
    let observation = vec![0.5; image.obs_len()];
    let outcome = with_head::<_, actq::error::Error>(image, |head| {
        // Both may refuse: a value may leave f32's range.
        let _ = head.self_test();
        let whole = head.step(&observation).map(<[f32]>::to_vec);
        head.reset();
        head.begin(&observation)?;
        let least = head.least_budget();
        let pieces = loop {
            match head.poll(least) {
                Ok(Poll::Pending) => {}
                Ok(Poll::Ready(action)) => break Ok(action.to_vec()),
                Err(error) => break Err(error),
            }
        };
        let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
        assert_eq!(whole.map(bits), pieces.map(bits));
        Ok(())
    });
    drop(outcome);
}

fuzz_target!(|bytes: &[u8]| {
    run(bytes);
    let mut sealed = bytes.to_vec();
    if seal(&mut sealed).is_ok() {
        run(&sealed);
    }
});
