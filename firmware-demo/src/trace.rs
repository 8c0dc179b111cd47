//! Location of a program after a stack overflow.

/// Index of the program counter in an exception frame.
const PC: usize = 6;

/// Returns the program counter from `words`, the stack from its pointer on. With `is_stacked` they begin with the
/// core's exception frame; else they give the innermost call. `half` reads the halfword at an address of the code;
/// `None` outside the code.
pub fn program_counter(
    mut words: impl Iterator<Item = u32>,
    is_stacked: bool,
    half: impl Fn(u32) -> Option<u16>,
) -> Option<u32> {
    if is_stacked { words.nth(PC) } else { innermost_call(words, half) }
}

/// Returns the address of the call whose return address is the first one in `words`, the stack from its pointer on.
/// `half` reads the halfword at an address of the code; `None` outside the code.
///
/// A word counts as a return address if it is odd (a Thumb address) and follows a call (Arm DDI 0403E, A7.7.18 and
/// A7.7.19).
fn innermost_call(mut words: impl Iterator<Item = u32>, half: impl Fn(u32) -> Option<u16>) -> Option<u32> {
    words.find_map(|word| {
        let back = word.checked_sub(1).filter(|back| back % 2 == 0)?;
        let before = |bytes| Some((back.checked_sub(bytes)?, half(back.checked_sub(bytes)?)?));
        let (at, last) = before(2)?;
        // BLX of a register.
        if last & 0xff87 == 0x4780 {
            return Some(at);
        }
        let (at, first) = before(4)?;
        (first & 0xf800 == 0xf000 && last & 0xd000 == 0xd000).then_some(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// BL, its second half, NOP, BLX r3, NOP at 0x100.
    const CODE: [u16; 5] = [0xf7ff, 0xfffe, 0xbf00, 0x4798, 0xbf00];

    fn half(address: u32) -> Option<u16> {
        CODE.get(usize::try_from(address.checked_sub(0x100)?).ok()? / 2).copied()
    }

    #[test]
    fn an_exception_frame_precedes_the_calls() {
        let words = [1, 2, 3, 4, 5, 0x105, 0x10a, 0x0100_0000];
        assert_eq!(program_counter(words.into_iter(), true, half), Some(0x10a));
        assert_eq!(program_counter(words.into_iter(), false, half), Some(0x100));
        assert_eq!(program_counter(words.into_iter().take(PC), true, half), None);
    }

    #[test]
    fn a_return_address_follows_a_call() {
        let found = |words: &[u32]| innermost_call(words.iter().copied(), half);
        assert_eq!(found(&[0x105]), Some(0x100));
        assert_eq!(found(&[0x109]), Some(0x106));
        // Even, not after a call, outside the code, at its begin.
        assert_eq!(found(&[0x104, 0x107, 0x10b, 0x103, 0x101, 0, 1, 2, u32::MAX]), None);
        assert_eq!(found(&[0xffff_ffff, 0x104, 0x109, 0x105]), Some(0x106));
    }
}
