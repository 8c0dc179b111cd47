//! The harness: checks its image, self-tests it, and runs it for a host.
//!
//! Without arguments it replays the image's self-test observations and prints the actions' bits. With the argument
//! `serve` it reads observations from standard input and writes actions to standard output, in the protocol of `actq
//! serve`. `poll N` does the same in polls of N instructions, `ops N` in polls of one operation each. `restart` saves
//! the state before every step, resets, and restores it. `stack` prints the stack of a step. Every step, or begin and each poll, is a counted region.
//!
//! The image is the one in the slot, if any, else the built-in one (environment variable `ACTQ_IMAGE`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::{Display, Write as _};
    use core::task::Poll;

    use actq_firmware_support::machine::{entry, singleton};
    #[cfg(not(actq_small))]
    use actq_firmware_support::stack::Room;
    use actq_firmware_support::{count, host, slot};
    use actq_kernels::{Head, Image, StepError, include_image};
    use actq_link::{NO_ACTION, RESET, STEP};

    static BUILT_IN: &[u8] = include_image!(env!(
        "ACTQ_IMAGE",
        "set ACTQ_IMAGE to the absolute path of the image to build in (`actq quantize` makes one)"
    ));

    /// Scratch memory in words; the image's header has its need.
    const SCRATCH: usize = if cfg!(actq_small) { 1536 } else { 24 * 1024 };
    /// Length of the longest observation for `serve`.
    const MAX_OBSERVATION: usize = if cfg!(actq_small) { 64 } else { 1024 };
    /// Length of the longest state for `restart`, in bytes.
    const MAX_SAVED: usize = if cfg!(actq_small) { 1024 } else { 8192 };

    #[entry]
    fn main() -> ! {
        let outcome = run();
        if let Err(message) = &outcome
            && let Some(mut err) = host::stderr()
        {
            let _ = writeln!(err, "firmware: {message}");
        }
        host::exit(outcome.is_ok())
    }

    type Message = heapless::String<120>;

    fn message(what: &str, detail: impl Display) -> Message {
        let mut text = Message::new();
        // A text longer than the buffer is truncated; nothing depends on it.
        let _ = write!(text, "{what}: {detail}");
        text
    }

    fn run() -> Result<(), Message> {
        let image = Image::new_checked(slot::image().unwrap_or(BUILT_IN)).map_err(|e| message("image", e))?;
        let scratch = singleton!(: [u32; SCRATCH] = [0; SCRATCH]).ok_or_else(|| message("scratch", "taken twice"))?;
        let mut head = Head::new(image, scratch).map_err(|e| message("head", e))?;
        // Now, and not within the first counted step.
        head.least_budget();
        head.self_test().map_err(|e| message("self-test", e))?;
        #[cfg(feature = "attention")]
        head.set_test_prefix();
        let arguments = host::arguments();
        let number = arguments.split_once(' ').and_then(|(_, n)| n.parse().ok());
        match (arguments.split(' ').next(), number) {
            _ if arguments.is_empty() => replay(&mut head),
            _ if arguments == "serve" => serve(&mut head, Run::Whole),
            #[cfg(not(actq_small))]
            _ if arguments == "stack" => stack(&mut head),
            _ if arguments == "restart" => serve(&mut head, Run::Restarts),
            (Some("poll"), Some(budget)) => serve(&mut head, Run::Polls(budget)),
            (Some("ops"), Some(budget)) => serve(&mut head, Run::Ops(budget)),
            _ => Err(message("unknown argument", arguments.as_str())),
        }
    }

    /// The way to run a step.
    #[derive(Clone, Copy)]
    enum Run {
        Whole,
        /// From a saved state.
        Restarts,
        /// In polls of this many instructions.
        Polls(u32),
        /// In polls that also end after each operation.
        Ops(u32),
    }

    impl Run {
        fn step<'h>(self, head: &'h mut Head<'_, '_>, observation: &[f32]) -> Result<&'h [f32], StepError> {
            match self {
                Self::Whole => return count::region(|| head.step(observation)),
                Self::Restarts => {
                    restart(head);
                    return head.step(observation);
                }
                Self::Polls(budget) => {
                    count::region(|| head.begin(observation))?;
                    while count::region(|| head.poll(budget).map(|p| p.is_pending()))? {}
                }
                Self::Ops(budget) => {
                    count::region(|| head.begin(observation))?;
                    while count::region(|| head.poll_op(budget).map(|p| p.is_pending()))? {}
                }
            }
            match head.poll(u32::MAX)? {
                Poll::Ready(action) => Ok(action),
                Poll::Pending => Err(StepError::NotBegun),
            }
        }
    }

    /// Saves the state, resets it, and restores it. If that fails, the state stays reset, and the actions differ.
    #[inline(never)]
    fn restart(head: &mut Head<'_, '_>) {
        let mut saved = [0; MAX_SAVED];
        let Some(saved) = saved.get_mut(..head.saved_len()) else { return head.reset() };
        let kept = head.save(saved);
        head.reset();
        if kept.is_ok() {
            let _ = head.restore(saved);
        }
    }

    /// Replays the self-test observations and prints each action's bits.
    fn replay(head: &mut Head<'_, '_>) -> Result<(), Message> {
        let mut out = host::stdout().ok_or_else(|| message("output", "no semihosting host"))?;
        let image = *head.image();
        let _ = writeln!(out, "{}: crc32 {:08x}, self-test passed", image.name(), image.crc());
        let mut step = 0;
        while let Some((observation, _)) = image.self_test(step) {
            let action =
                count::region(|| head.step(bytemuck::must_cast_slice(observation))).map_err(|e| message("step", e))?;
            let _ = write!(out, "step {step}:");
            for a in action {
                let _ = write!(out, " {:08x}", a.to_bits());
            }
            let _ = writeln!(out);
            step += 1;
        }
        Ok(())
    }

    /// Prints the bytes of stack that a step takes.
    #[cfg(not(actq_small))]
    #[inline(never)]
    fn stack(head: &mut Head<'_, '_>) -> Result<(), Message> {
        const WORDS: usize = 4 * 1024;
        let mut out = host::stdout().ok_or_else(|| message("output", "no semihosting host"))?;
        let image = *head.image();
        let Some((observation, _)) = image.self_test(0) else { return Err(message("image", "no self-test")) };
        // SAFETY: the stack is at the end of RAM with more than WORDS free words, and no interrupt is enabled.
        let room = unsafe { Room::below_here(WORDS) };
        // SAFETY: as above.
        unsafe { room.paint() };
        let stepped = head.step(bytemuck::must_cast_slice(observation)).map(|_| ());
        let _ = writeln!(out, "stack {}", room.used());
        stepped.map_err(|e| message("step", e))
    }

    /// Answers requests of the pipe protocol from standard input until it ends. A step without an action, because the
    /// observation or the network leaves f32's range, is answered with NaNs.
    fn serve(head: &mut Head<'_, '_>, run: Run) -> Result<(), Message> {
        let input = host::File::open(c"/dev/stdin", false).ok_or_else(|| message("input", "cannot be opened"))?;
        let output = host::File::open(c"/dev/stdout", true).ok_or_else(|| message("output", "cannot be opened"))?;
        let mut buffer = [0f32; MAX_OBSERVATION];
        let observation = buffer
            .get_mut(..head.image().obs_len())
            .ok_or_else(|| message("observation", "too long for the buffer"))?;
        let mut command = [0u8];
        while input.read_exact(&mut command) {
            match command {
                [RESET] => head.reset(),
                [STEP] => {
                    if !input.read_exact(bytemuck::must_cast_slice_mut(observation)) {
                        return Err(message("input", "ended inside an observation"));
                    }
                    let act_len = head.image().act_len();
                    let written = match run.step(head, observation) {
                        Ok(action) => output.write_all(bytemuck::must_cast_slice(action)),
                        Err(StepError::ObservationNotFinite { .. } | StepError::NotFinite | StepError::Orientation) => {
                            (0..act_len).all(|_| output.write_all(&NO_ACTION.to_le_bytes()))
                        }
                        Err(e) => return Err(message("step", e)),
                    };
                    if !written {
                        return Err(message("output", "cannot be written"));
                    }
                }
                [other] => return Err(message("unknown command byte", other)),
            }
        }
        Ok(())
    }
}
