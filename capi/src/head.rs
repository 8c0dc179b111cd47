//! Heads: step, slices, saved state.

use core::ops::Range;
use core::task::Poll;

use actq_kernels::{Head, StepError};

use crate::image::{ActqImage, opened};
use crate::memory::{Buffer, addresses, all_apart, apart, seal};
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
    /// The first word of the scratch memory, which names its head ([`name`]). The head does not use it.
    owner: *const u32,
    head: Head<'static, 'static>,
    /// `true` from the begin of a step until its action is ready.
    polling: bool,
}

const _: () = assert!(size_of::<Running>() <= size_of::<ActqHead>() && align_of::<Running>() <= align_of::<ActqHead>());

/// Returns the word by which scratch memory names its head: two heads at the same time have different ones.
fn name(head: *const Running) -> u32 {
    let address = seal(head, MAGIC) as u64;
    (address ^ address >> 32) as u32
}

impl Running {
    /// Checks the caller's buffer: it shares no byte with this head, its scratch memory and its image.
    fn buffer<T>(&self, pointer: *const T, len: usize) -> Result<Buffer<T>, Failure> {
        let buffer = Buffer::or_empty(pointer, len)?;
        let [scratch, image] = &self.memory;
        let head = self as *const Self as usize;
        let head = head..head + size_of::<Self>();
        [&head, scratch, image].into_iter().try_for_each(|own| apart(own, &buffer.addresses()))?;
        Ok(buffer)
    }

    /// Checks an action's buffer.
    fn action(&self, action: *mut f32, len: usize) -> Result<Buffer<f32>, Failure> {
        if len != self.head.image().act_len() {
            return Err(Code::Length.into());
        }
        self.buffer(action, len)
    }

    /// Borrows an observation.
    ///
    /// # Safety
    ///
    /// As [`Buffer::read`].
    unsafe fn observation<'b>(&self, observation: *const f32, len: usize) -> Result<&'b [f32], Failure> {
        if len != self.head.image().obs_len() {
            return Err(Code::ObservationLength.into());
        }
        // SAFETY: as the caller promises.
        Ok(unsafe { self.buffer(observation, len)?.read() })
    }
}

/// Writes an action.
///
/// # Safety
///
/// As [`Buffer::write`].
unsafe fn write(to: Buffer<f32>, action: &[f32]) {
    // SAFETY: as the caller promises.
    let to = unsafe { to.write() };
    // The lengths are equal, which `copy_from_slice` would check again, with a panic.
    to.iter_mut().zip(action).for_each(|(to, value)| *to = *value);
}

/// Borrows an initialized head, and runs `run` with it.
///
/// # Safety
///
/// `head` is null, misaligned, or valid for reads and writes, and nothing else uses it meanwhile; if it was
/// initialized, the image's bytes are as they were, and its scratch memory is still there: another head's memory shares
/// none of it, or its first word.
unsafe fn with(head: *mut ActqHead, run: impl FnOnce(&mut Running) -> Result<(), Failure>) -> ActqStatus {
    let place = head.cast::<Running>();
    status(Buffer::new(place.cast::<usize>(), 1).and_then(|found| {
        // SAFETY: as the caller promises; a word is any bits.
        if unsafe { found.read() } != [seal(place, MAGIC)] {
            return Err(Code::NotInitialized.into());
        }
        // SAFETY: only `actq_head_init` writes this seal, with a head after it, at this address; its scratch memory
        // is still there.
        if unsafe { (*place).owner.read() } != name(place) {
            return Err(Code::ScratchTaken.into());
        }
        // SAFETY: as above, and no other head has taken the scratch memory.
        run(unsafe { &mut *place })
    }))
}

/// Initializes a head of `image` in `scratch`, of at least `actq_sizes.scratch_words` words, and resets it. `scratch`
/// belongs to the head from now on, and heads must not share it. A call returns `ACTQ_SCRATCH_TAKEN` if another head was
/// initialized over the first word of this head's memory; other overlaps are not noticed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_head_init(
    head: *mut ActqHead,
    image: *const ActqImage,
    scratch: *mut u32,
    words: usize,
) -> ActqStatus {
    let init = || {
        let structure = Buffer::new(head.cast::<usize>(), size_of::<ActqHead>() / size_of::<usize>())?;
        let of_image = Buffer::new(image, 1)?.addresses();
        apart(&structure.addresses(), &of_image)?;
        // SAFETY: as the caller promises.
        let (opened, scratch) = (unsafe { opened(image) }, Buffer::new(scratch, words));
        let memory = [
            scratch.as_ref().map_or(0..0, |scratch| scratch.addresses()),
            opened.as_ref().map_or(0..0, |opened| opened.bytes()),
        ];
        all_apart(&[&structure.addresses(), &of_image, &memory[0], &memory[1]])?;
        // From here on the former head is gone, whatever happens.
        // SAFETY: as the caller promises.
        unsafe { structure.write() }.fill(0);
        let (opened, scratch) = (opened?, scratch?);
        let place = head.cast::<Running>();
        let owner = scratch.pointer();
        // SAFETY: as the caller promises.
        let (first, rest) = unsafe { scratch.write() }.split_first_mut().ok_or(Code::ScratchTooSmall)?;
        let new = Head::new(opened.image, rest)?;
        *first = name(place);
        // SAFETY: valid as the words above.
        unsafe { place.write(Running { seal: seal(place, MAGIC), memory, owner, head: new, polling: false }) };
        Ok(())
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
/// After an error of the observation's values or of the network (81 to 83, 89 to 91) `action` is unchanged, the recurrent
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
            let action = running.action(action, action_len)?;
            let observation = running.observation(observation, observation_len)?;
            apart(&action.addresses(), &addresses(observation))?;
            write(action, running.head.step(observation)?);
            Ok(())
        })
    }
}

/// Begins a step with an observation; `actq_poll` does the work. A step that has begun and is not ready is dropped; if
/// a poll has already worked on it, the recurrent state is reset. The first call takes longer, unless
/// `actq_least_budget` was called before.
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

/// Gives the smallest budget of a poll, instructions. The first call for a head computes it, which takes about as long
/// as a short step: call it before the control loop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_least_budget(head: *mut ActqHead, budget: *mut u32) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            let budget = running.buffer(budget, 1)?;
            budget.put(running.head.least_budget());
            Ok(())
        })
    }
}

/// Runs a slice of the step that has begun, of at most `budget` instructions by the cost model, at least
/// `actq_cost.least_budget`. Returns `ACTQ_PENDING` until the action is ready and written. However a step is cut,
/// its bits are the same. Without a step that has begun it returns the last action again, also one of `actq_play`.
/// Instructions are those of a Cortex-M4 with FPU: on other cores a slice takes another time. Errors are those of
/// `actq_step`; 89 (no action is young enough) ends the step and resets the recurrent state and the chunk, too.
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
            let action = running.action(action, action_len)?;
            match running.head.poll(budget) {
                Ok(Poll::Pending) => Err(Code::Pending.into()),
                Ok(Poll::Ready(computed)) => {
                    write(action, computed);
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

/// Skips `periods` control periods: the chunk's actions for them never play.
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
            let action = running.action(action, action_len)?;
            match running.head.play() {
                Ok(played) => {
                    write(action, played);
                    Ok(())
                }
                Err(error) => {
                    // Any other error ends a step that has begun.
                    running.polling &= matches!(error, StepError::Stale);
                    Err(error.into())
                }
            }
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

/// Gives the bytes of the prefix, keys and values from a host, that the image's attentions read; 0 if they read none. Only
/// libraries with the feature `attention` have this function and the next two.
#[cfg(feature = "attention")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_prefix_bytes(head: *mut ActqHead, bytes: *mut usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.buffer(bytes, 1)?.put(running.head.image().prefix_bytes());
            Ok(())
        })
    }
}

/// Sets the prefix, of `actq_prefix_bytes` bytes. Every step uses it until the next one, also after a reset. After an error
/// the head keeps the one before.
#[cfg(feature = "attention")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_set_prefix(head: *mut ActqHead, from: *const u8, bytes: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe { with(head, |running| Ok(running.head.set_prefix(running.buffer(from, bytes)?.read())?)) }
}

/// Clears the prefix: no step runs the network until the next one. A step that is being polled is dropped.
#[cfg(feature = "attention")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_clear_prefix(head: *mut ActqHead) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.polling = false;
            running.head.clear_prefix();
            Ok(())
        })
    }
}

/// Gives the bytes of a saved state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_saved_bytes(head: *mut ActqHead, bytes: *mut usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.buffer(bytes, 1)?.put(running.head.saved_len());
            Ok(())
        })
    }
}

/// Writes the state to `to`, of `actq_saved_bytes` bytes. A head of the same image that restores it continues with the
/// same bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_save(head: *mut ActqHead, to: *mut u8, bytes: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe { with(head, |running| Ok(running.head.save(running.buffer(to, bytes)?.write())?)) }
}

/// Restores a saved state. After an error, as while a step is being polled, the head is as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_restore(head: *mut ActqHead, from: *const u8, bytes: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(head, |running| {
            running.head.restore(running.buffer(from, bytes)?.read())?;
            running.polling = false;
            Ok(())
        })
    }
}
