//! The same bits as the kernels, for steps, slices and saved states.

use actq_c::{
    ACTQ_ABI, ActqHead, ActqImage, CCost, CPort, Code, Sizes, Text, actq_abi, actq_begin, actq_image_cost,
    actq_image_name, actq_least_budget, actq_pass, actq_play, actq_poll, actq_reset, actq_restore, actq_save,
    actq_saved_bytes, actq_seed, actq_self_test, actq_status_text, actq_step,
};
use actq_kernels::{Head, HeadError, Image, ImageError, SavedError, StepError};
use actq_testkit::Random;

use super::{BYTES, OK, Program};

const STEPS: usize = 50;
const PENDING: i32 = Code::Pending as i32;

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Observations, one a step.
fn observations(len: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(1);
    (0..STEPS).map(|_| (0..len).map(|_| random.unit()).collect()).collect()
}

/// Actions of the kernels from a reset.
fn expected(observations: &[Vec<f32>]) -> Vec<Vec<u32>> {
    let image = Image::new_checked(&BYTES.0).expect("a valid image");
    let mut scratch = vec![0; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch).expect("enough scratch memory");
    observations.iter().map(|observation| bits(head.step(observation).expect("an action"))).collect()
}

#[test]
fn steps_slices_and_restores_match_the_kernels() {
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let (observations, mut action) = (observations(obs), vec![0.0; act]);
    let expected = expected(&observations);
    let (image, head) = (program.image(), program.head());
    let mut cost = CCost::default();
    // SAFETY: all pointers are valid, with their lengths.
    unsafe {
        assert_eq!(actq_image_cost(image, &mut cost), OK);
        assert_eq!(actq_self_test(head), OK);
        let mut len = 0;
        assert_eq!(actq_saved_bytes(head, &mut len), OK);
        let mut saved = vec![0; len];
        for (step, (observation, expected)) in observations.iter().zip(&expected).enumerate() {
            if step == STEPS / 2 {
                assert_eq!(actq_save(head, saved.as_mut_ptr(), len), OK);
            }
            assert_eq!(actq_step(head, observation.as_ptr(), obs, action.as_mut_ptr(), act), OK);
            assert_eq!(&bits(&action), expected, "step {step}");
        }
        assert_eq!(actq_restore(head, saved.as_ptr(), len), OK);
        for (observation, expected) in observations.iter().zip(&expected).skip(STEPS / 2) {
            assert_eq!(actq_begin(head, observation.as_ptr(), obs), OK);
            let mut status = PENDING;
            let mut slices = 0;
            while status == PENDING {
                status = actq_poll(head, cost.least_budget, action.as_mut_ptr(), act);
                slices += 1;
            }
            assert_eq!((status, &bits(&action)), (OK, expected), "{slices} slices");
        }
        assert_eq!(actq_reset(head), OK);
        assert_eq!(actq_step(head, observations[0].as_ptr(), obs, action.as_mut_ptr(), act), OK);
        assert_eq!(bits(&action), expected[0]);
        assert_eq!(actq_seed(head, 7), OK);
        assert_eq!(actq_pass(head, 1), OK);
        assert_eq!(actq_play(head, action.as_mut_ptr(), act), Code::Stale as i32, "nothing to play after a reset");
    }
}

#[test]
fn names_costs_and_numbers_match_the_image() {
    let mut program = Program::start();
    let expected = Image::new_checked(&BYTES.0).expect("a valid image");
    let (mut name, mut cost) = (Text { data: std::ptr::null(), len: 0 }, CCost::default());
    // SAFETY: the pointers are valid.
    let name = unsafe {
        assert_eq!(actq_image_name(program.image(), &mut name), OK);
        assert_eq!(actq_image_cost(program.image(), &mut cost), OK);
        std::slice::from_raw_parts(name.data.cast::<u8>(), name.len)
    };
    assert_eq!(name, expected.name().as_bytes());
    let step = expected.step_cost();
    assert_eq!(
        (cost.instructions, cost.cycles, cost.least_budget),
        (step.instructions, step.cycles, expected.least_budget())
    );
    let (head, mut least) = (program.head(), 0);
    // SAFETY: the pointers are valid.
    assert_eq!((unsafe { actq_least_budget(head, &mut least) }, least), (OK, cost.least_budget));
    assert_eq!(program.lengths(), (expected.obs_len(), expected.act_len()));
    assert_eq!((program.sizes.crc, program.sizes.image_bytes), (expected.crc(), BYTES.0.len()));
    assert_eq!(actq_abi(), ACTQ_ABI);
}

/// Every error of the kernels has a code with its number and text; for a number that is none, there is a text, too.
#[test]
fn every_error_of_the_kernels_has_a_code() {
    let text = |status| {
        // SAFETY: it returns a string that ends in a zero.
        unsafe { std::ffi::CStr::from_ptr(actq_status_text(status)) }.to_str().expect("text")
    };
    let has_code = |number: u8| Code::ALL.iter().any(|code| *code as i32 == i32::from(number));
    for error in ImageError::ALL {
        assert_eq!(text(error.code().into()), error.text());
    }
    let steps = [
        StepError::ObservationLength { expected: 1, given: 0 },
        StepError::ObservationNotFinite { index: 0 },
        StepError::NotFinite,
        StepError::Damaged,
        StepError::SelfTest { step: 0 },
        StepError::Budget { needed: 1, given: 0 },
        StepError::NotBegun,
        StepError::Stale,
        StepError::ObservationRange { index: 0 },
        StepError::Orientation,
    ];
    assert!(steps.iter().all(|error| has_code(error.code())));
    let saved = [
        SavedError::Length { needed: 1, given: 0 },
        SavedError::Version,
        SavedError::Image,
        SavedError::Damaged,
        SavedError::Begun,
    ];
    assert!(saved.iter().all(|error| has_code(error.code())));
    assert!(has_code(HeadError::ScratchTooSmall { needed: 1, given: 0 }.code()));
    assert_eq!([text(127), text(-2), text(i32::MIN)], ["unknown status"; 3]);
    assert!(Code::ALL.iter().all(|code| text(*code as i32) == code.text().to_str().expect("text")));
}

/// Another layout, or another number, needs another `ACTQ_ABI`.
#[cfg(target_pointer_width = "64")]
#[test]
fn structures_and_numbers_match_the_interface_version() {
    let sizes = [
        size_of::<ActqImage>(),
        size_of::<ActqHead>(),
        size_of::<Sizes>(),
        size_of::<Text>(),
        size_of::<CPort>(),
        size_of::<CCost>(),
    ];
    assert_eq!((ACTQ_ABI, sizes), (3, [48, 320, 64, 16, 64, 24]));
    let own: Vec<_> = Code::ALL.iter().filter(|code| !(1..128).contains(&(**code as i32))).copied().collect();
    let numbers: Vec<i32> = own.iter().map(|code| *code as i32).collect();
    assert_eq!(
        (own, numbers),
        (
            vec![
                Code::Ok,
                Code::Pending,
                Code::Null,
                Code::Alignment,
                Code::Length,
                Code::NotInitialized,
                Code::Overlap,
                Code::Polling,
                Code::NoSuchPort,
                Code::AbiDiffers,
                Code::ScratchTaken,
            ],
            vec![0, -1, 128, 129, 130, 131, 132, 133, 134, 135, 136],
        )
    );
}
