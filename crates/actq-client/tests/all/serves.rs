//! A controller as a simulator's policy.

use std::sync::atomic::Ordering;

use actq_client::serve::serve;
use actq_controller::Output;
use actq_controller::slots::Anyone;
use actq_link::{NO_ACTION, RESET, STEP};

use crate::simulated::Simulated;

fn step(values: [f32; 4]) -> Vec<u8> {
    [STEP].into_iter().chain(values.into_iter().flat_map(f32::to_le_bytes)).collect()
}

fn actions(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// Requests; calls the function with the number of each read before it.
struct Requests<F>(Vec<u8>, usize, F);

impl<F: FnMut(usize)> std::io::Read for Requests<F> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.1 += 1;
        (self.2)(self.1);
        let count = buffer.len().min(self.0.len());
        buffer[..count].copy_from_slice(&self.0[..count]);
        self.0.drain(..count);
        Ok(count)
    }
}

#[test]
fn steps_are_answered_with_the_heads_actions() {
    // More faults than these would now and then damage one observation in all its attempts.
    for (arm, faults) in [(false, 0), (true, 0), (false, 20)] {
        let controller = Simulated::start(faults, || Anyone);
        let mut input = Vec::new();
        for episode in 0..3u8 {
            input.push(RESET);
            for i in 0..20u8 {
                input.extend(step([f32::from(episode) / 8.0, f32::from(i) / 32.0, 0.0, 0.0]));
            }
        }
        let mut output = Vec::new();
        serve(&mut controller.client(), arm, &input[..], &mut output).expect("the controller answers");
        let expected: Vec<f32> =
            (0..3u8).flat_map(|e| (0..20u8).flat_map(move |i| [f32::from(e) / 16.0, f32::from(i) / 64.0])).collect();
        assert_eq!(actions(&output), expected, "armed {arm}, {faults} faults in 1000");
        let coasts = || controller.outputs().iter().all(|output| *output == Output::Coast);
        // It disarms at the end; the next tick lets the outputs coast.
        while !coasts() {
            std::thread::yield_now();
        }
    }
}

#[test]
fn refused_observations_and_protocol_errors_are_reported() {
    let controller = Simulated::start(0, || Anyone);
    let input = [step([f32::NAN, 0.0, 0.0, 0.0]), step([1.0; 4])].concat();
    let mut output = Vec::new();
    serve(&mut controller.client(), false, &input[..], &mut output).expect("the controller answers");
    let bits: Vec<u32> = actions(&output).into_iter().map(f32::to_bits).collect();
    assert_eq!(bits, [NO_ACTION.to_bits(), NO_ACTION.to_bits(), 0.5f32.to_bits(), 0.5f32.to_bits()]);
    let error = serve(&mut controller.client(), false, &b"x"[..], Vec::new()).expect_err("no such command");
    assert!(error.to_string().contains("0x78"), "{error:#}");
    let error = serve(&mut controller.client(), false, &step([0.0; 4])[..9], Vec::new()).expect_err("half a step");
    assert!(error.to_string().contains("16 bytes"), "{error:#}");
}

#[test]
fn a_stopped_controller_ends_serving_with_its_reason() {
    let controller = Simulated::start(0, || Anyone);
    let control = &controller.control;
    // The simulator pauses after some steps until the deadline has passed.
    let input = Requests((0..100).flat_map(|_| step([0.5; 4])).collect(), 0, |read| {
        if read == 40 {
            control.miss_the_deadline(std::thread::yield_now);
        }
    });
    let error = serve(&mut controller.client(), true, input, Vec::new()).expect_err("it has latched");
    assert!(error.to_string().contains("no valid observation arrived within the deadline"), "{error:#}");
    assert_eq!(control.starts.load(Ordering::Relaxed), 1);
}

/// It is late by more than the time of all attempts at a step.
#[test]
fn a_late_controller_still_answers_the_step() {
    let controller = Simulated::start(0, || Anyone);
    let input = Requests(step([0.5, 0.25, 0.0, 0.0]), 0, |read| {
        if read == 2 {
            controller.control.stall(1500);
        }
    });
    let mut output = Vec::new();
    serve(&mut controller.client(), false, input, &mut output).expect("the controller answers");
    assert_eq!(actions(&output), [0.25, 0.125]);
}
