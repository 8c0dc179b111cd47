//! Shared code of the measuring programs. Built for a host they only print a note.
#![cfg_attr(target_os = "none", no_std)]

pub mod functions;
pub mod trigonometry;

/// Exits with a note when the programs are built for a host.
#[cfg(not(target_os = "none"))]
pub fn main() {
    eprintln!("this is firmware: build it with --target thumbv7em-none-eabihf, or see `cargo xtask bench`");
    std::process::exit(1);
}

/// Declares a program whose code is measured, and which is not run: it calls a function of an image, scratch memory and
/// an observation, without text or host.
#[macro_export]
macro_rules! measured {
    ($run:ident) => {
        #[panic_handler]
        fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
            loop {
                cortex_m::asm::wfi();
            }
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            use core::hint::black_box;
            let mut scratch = [0u32; 256];
            loop {
                // The compiler cannot remove what it cannot see through.
                black_box($run(black_box(&[]), black_box(&mut scratch), black_box(&[])));
            }
        }
    };
}

/// Returns a generator of pseudorandom words, the same in every run (Marsaglia's xorshift32).
pub fn random_words() -> impl FnMut() -> u32 {
    let mut seed = 0x1234_5678u32;
    move || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    }
}
