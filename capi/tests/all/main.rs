//! The C interface called as C calls it: the same bits as the kernels, and errors for every misuse.

mod misuse;
mod parity;

use std::mem::MaybeUninit;

use actq_c::{ActqHead, ActqImage, ActqStatus, Code, Sizes, actq_head_init, actq_image_open, actq_image_sizes};

/// An image, aligned.
pub(crate) static BYTES: Aligned<{ FILE.len() }> = Aligned(*FILE);
const FILE: &[u8; include_bytes!("../../../kernels/tests/valid.actq").len()] =
    include_bytes!("../../../kernels/tests/valid.actq");

#[repr(align(8))]
pub(crate) struct Aligned<const N: usize>(pub(crate) [u8; N]);

/// Parts of a C program: structures, scratch memory and buffers, at addresses that stay.
pub(crate) struct Program {
    pub(crate) image: Box<MaybeUninit<ActqImage>>,
    pub(crate) head: Box<MaybeUninit<ActqHead>>,
    pub(crate) scratch: Vec<u32>,
    pub(crate) sizes: Sizes,
}

impl Program {
    /// Opens the image and initializes a head.
    pub(crate) fn start() -> Self {
        let (image, head) = (Box::new(MaybeUninit::uninit()), Box::new(MaybeUninit::uninit()));
        let mut program = Self { image, head, scratch: Vec::new(), sizes: Sizes::default() };
        let image = program.image();
        // SAFETY: the pointers are valid.
        unsafe {
            assert_eq!(actq_image_open(image, BYTES.0.as_ptr(), BYTES.0.len()), OK);
            assert_eq!(actq_image_sizes(image, &mut program.sizes), OK);
        }
        program.scratch = vec![0; program.sizes.scratch_words];
        let (head, scratch) = (program.head(), program.scratch.as_mut_ptr());
        // SAFETY: the pointers are valid.
        assert_eq!(unsafe { actq_head_init(head, image, scratch, program.scratch.len()) }, OK);
        program
    }

    pub(crate) fn image(&mut self) -> *mut ActqImage {
        self.image.as_mut_ptr()
    }

    pub(crate) fn head(&mut self) -> *mut ActqHead {
        self.head.as_mut_ptr()
    }

    /// Returns the numbers of values of an observation and of an action.
    pub(crate) fn lengths(&self) -> (usize, usize) {
        (self.sizes.observation_len, self.sizes.action_len)
    }
}

pub(crate) const OK: ActqStatus = Code::Ok as ActqStatus;
