//! Heads: step, slices, saved state.

use core::ops::Range;
use core::task::Poll;

use actq_kernels::{Head, StepError};

use crate::image::{ActqImage, opened};
use crate::memory::{addresses, all_apart, apart, check, put, seal, slice, slice_mut};
use crate::status::{ActqStatus, Code, Failure, status};

const MAGIC: u32 = u32::from_le_bytes(*b"ACTH");

/// A head. The caller provides its memory and does not look into it. It refers to the image's bytes and to the scratch
/// memory, and must not be moved or copied.
#[derive(Debug)]
#[repr(C)]
pub struct ActqHead {
    opaque: [usize; 40],
}

/// The content of an initialized [`ActqHead`].
#[repr(C)]
struct Running {
    seal: usize,
    /// Addresses of the scratch memory and of the image.
    memory: [Range<usize>; 2],
    head: Head<'static, 'static>,
    /// `true` from the begin of a step until its action is ready.
    polling: bool,
}

const _: () = assert!(size_of::<Running>() <= size_of::<ActqHead>() && align_of::<Running>() <= align_of::<ActqHead>());

impl Running {
    /// Requires that the caller's buffer shares no byte with this head, its scratch memory and its image.
    fn apart_from<T>(&self, buffer: *const T, len: usize) -> Result<(), Failure> {
        if len > 0 {
            check(buffer, len)?;
        }
        let buffer = addresses(buffer, len);
        let [scratch, image] = &self.memory;
        [&addresses(self, 1), scratch, image].into_iter().try_for_each(|own| apart(own, &buffer))
    }

    /// Checks an action's buffer. It is borrowed only when the action is ready: it may be the observation's, too.
    fn check_action(&self, action: *mut f32, len: usize) -> Result<(), Failure> {
        if len != self.head.image().act_len() {
            return Err(Code::Length.into());
        }
        self.apart_from(action, len)
    }

    /// Borrows an observation.
    ///
    /// # Safety
    ///
    /// As [`slice`].
    unsafe fn observation<'b>(&self, observation: *const f32, len: usize) -> Result<&'b [f32], Failure> {
        if len != self.head.image().obs_len() {
            return Err(Code::ObservationLength.into());
        }
        self.apart_from(observation, len)?;
        // SAFETY: as the caller promises.
        unsafe { slice(observation, len) }
    }
}

/// Writes an action.
///
/// # Safety
///
/// As [`slice_mut`].
unsafe fn write(to: *mut f32, len: usize, action: &[f32]) -> Result<(), Failure> {
    // SAFETY: as the caller promises.
    let to = unsafe { slice_mut(to, len) }?;
    // The lengths are equal, which `copy_from_slice` would check again, with a panic.
    to.iter_mut().zip(action).for_each(|(to, value)| *to = *value);
    Ok(())
}

/// Borrows an initialized head, and runs `run` with it.
///
/// # Safety
///
/// `head` is null, misaligned, or valid for reads and writes, and nothing else uses it meanwhile; if it was initialized,
/// the image's bytes and the scratch memory are still its own.
unsafe fn with(head: *mut ActqHead, run: impl FnOnce(&mut Running) -> Result<(), Failure>) -> ActqStatus {
    let place = head.cast::<Running>();
    // SAFETY: as the caller promises; a word is any bits.
    let found = unsafe { slice(place.cast::<usize>(), 1) };
    status(found.and_then(|found| {
        if found.first() != Some(&seal(place, MAGIC)) {
            return Err(Code::NotInitialized.into());
        }
        // SAFETY: only `actq_head_init` writes this seal, with a head after it, at this address.
        run(unsafe { &mut *place })
    }))
}

/// Initializes a head of `image` in `scratch`, of at least `actq_sizes.scratch_words` words, and resets it. `scratch`
/// belongs to the head from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_head_init(
    head: *mut ActqHead,
    image: *const ActqImage,
    scratch: *mut u32,
    words: usize,
) -> ActqStatus {
    let init = || {
        // SAFETY: as the caller promises.
        unsafe { slice_mut(head.cast::<usize>(), size_of::<ActqHead>() / size_of::<usize>()) }?.fill(0);
        // SAFETY: as the caller promises.
        let opened = unsafe { opened(image) }?;
        check(scratch, words)?;
        let memory = [addresses(scratch, words), opened.bytes()];
        let structures = [addresses(head, 1), addresses(image, 1)];
        all_apart(&[&structures[0], &structures[1], &memory[0], &memory[1]])?;
        // SAFETY: as the caller promises.
        let new = Head::new(opened.image, unsafe { slice_mut(scratch, words) }?)?;
        let place = head.cast::<Running>();
        // SAFETY: valid as the words above.
        unsafe { put(place, Running { seal: seal(place, MAGIC), memory, head: new, polling: false }) }
    };
    status(init())
}

/// Clears the recurrent state, histories, all chunks, the last action and a step that has begun. The noise of a flow or
/// diffusion policy starts from the beginning.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_reset(head: *mut ActqHead) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.polling = false;
            running.head.reset();
            Ok(())
        })
    }
}

/// Sets the seed of a flow or diffusion policy's noise, 0 by default, and resets the head.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_seed(head: *mut ActqHead, seed: u32) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.polling = false;
            running.head.seed(seed);
            Ok(())
        })
    }
}

/// Computes the action for an observation. With action chunks it is the chunk's next action, and most steps do not run
/// the network. The call counts as one control period.
///
/// After an error of the observation's values or of the network (81 to 83, 90) `action` is unchanged, the recurrent
/// state and the chunk are reset, and the step limit holds from the last action.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_step(
    head: *mut ActqHead,
    observation: *const f32,
    observation_len: usize,
    action: *mut f32,
    action_len: usize,
) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            if running.polling {
                return Err(Code::Polling.into());
            }
            running.check_action(action, action_len)?;
            let computed = running.head.step(running.observation(observation, observation_len)?)?;
            write(action, action_len, computed)?;
            Ok(())
        })
    }
}

/// Begins a step with an observation; `actq_poll` does the work. A step that has begun and is not ready is dropped.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_begin(
    head: *mut ActqHead,
    observation: *const f32,
    observation_len: usize,
) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            let observation = running.observation(observation, observation_len)?;
            running.polling = false;
            running.head.begin(observation)?;
            running.polling = true;
            Ok(())
        })
    }
}

/// Runs a slice of the step that has begun, of at most `budget` instructions by the cost model, at least
/// `actq_cost.least_budget`. Returns `ACTQ_PENDING` until the action is ready and written. However a step is cut,
/// its bits are the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_poll(
    head: *mut ActqHead,
    budget: u32,
    action: *mut f32,
    action_len: usize,
) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.check_action(action, action_len)?;
            match running.head.poll(budget) {
                Ok(Poll::Pending) => Err(Code::Pending.into()),
                Ok(Poll::Ready(computed)) => {
                    write(action, action_len, computed)?;
                    running.polling = false;
                    Ok(())
                }
                Err(error) => {
                    running.polling &= matches!(error, StepError::Budget { .. });
                    Err(error.into())
                }
            }
        })
    }
}

/// Lets control periods pass without an action: the actions for these periods never play.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_pass(head: *mut ActqHead, periods: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.head.pass(periods);
            Ok(())
        })
    }
}

/// Plays the next action that chunks predict, without an observation: while a step is being polled, or when an
/// observation is missing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_play(head: *mut ActqHead, action: *mut f32, action_len: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.check_action(action, action_len)?;
            write(action, action_len, running.head.play()?)?;
            Ok(())
        })
    }
}

/// Plays the image's self-test and compares every action bit for bit; resets the head before and after it. It takes as
/// long as some steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_self_test(head: *mut ActqHead) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.polling = false;
            Ok(running.head.self_test()?)
        })
    }
}

/// Gives the bytes of a saved state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_saved_bytes(head: *mut ActqHead, bytes: *mut usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.apart_from(bytes, 1)?;
            put(bytes, running.head.saved_len())
        })
    }
}

/// Writes the state to `to`, of `actq_saved_bytes` bytes. A head of the same image that restores it continues with the
/// same bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_save(head: *mut ActqHead, to: *mut u8, bytes: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.apart_from(to, bytes)?;
            Ok(running.head.save(slice_mut(to, bytes)?)?)
        })
    }
}

/// Restores a saved state. After an error the head is as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_restore(head: *mut ActqHead, from: *const u8, bytes: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.apart_from(from, bytes)?;
            running.head.restore(slice(from, bytes)?)?;
            running.polling = false;
            Ok(())
        })
    }
}
