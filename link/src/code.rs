//! Names for the numbers in messages. A number keeps its meaning in all versions.

use core::fmt;

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal, $text:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $code,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The number.
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// What a number means; `None` where it means nothing.
            pub fn from_code(code: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| one.code() == code)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Self::$variant => $text,)*
                })
            }
        }
    };
}

codes! {
    /// What the controller does with its outputs.
    State {
        /// Outputs coast.
        Disarmed = 0, "disarmed";
        /// Outputs follow the head.
        Armed = 1, "armed";
        /// Outputs do each axis' safe action, until armed again or disarmed.
        Latched = 2, "latched in the safe action";
    }
}

codes! {
    /// What took an armed controller to its safe action.
    Fault {
        /// No good observation came within the deadline.
        Stale = 1, "no good observation came within the deadline";
        /// Observations came, but no action within the deadline.
        Late = 2, "the head gave no action within the deadline";
        /// The head ended a step with an error.
        Head = 3, "the head ended a step with an error";
        /// An action has another number of values than there are axes.
        ActionLength = 4, "an action has another number of values than there are axes";
        /// A value of an action is NaN or infinite.
        ActionNotFinite = 5, "a value of an action is not finite";
        /// The image in flash has changed.
        Image = 6, "the image in flash has changed: its checksum differs";
        /// The clock failed.
        Clock = 7, "the clock failed";
        /// The watchdog does not run.
        Watchdog = 8, "the watchdog does not run";
        /// A control tick ended after the next one was due.
        Overrun = 9, "a control tick took longer than its period";
        /// The hardware's break input switched the outputs off.
        Break = 10, "the break input switched the outputs off";
    }
}

codes! {
    /// Why a request was not done.
    Refusal {
        /// The token is not the one of the last status: the request is older than the controller's state.
        Token = 1, "the token is not the one of the last status; read the status and ask again";
        /// There is no valid image.
        Image = 2, "there is no valid image";
        /// The image's self-test failed.
        SelfTest = 3, "the image's self-test failed";
        /// The clock failed.
        Clock = 4, "the clock failed";
        /// The watchdog does not run.
        Watchdog = 5, "the watchdog does not run";
        /// No good observation came within the deadline.
        Stale = 6, "no good observation came within the deadline; send observations before arming";
        /// The controller is armed.
        Armed = 7, "not while armed; disarm first";
        /// There is no such parameter, or no such axis.
        Parameter = 8, "there is no such parameter or axis";
        /// The value is not finite or outside what the parameter takes.
        Range = 9, "the value is not finite or outside the parameter's range";
        /// A chunk does not begin where the last one ended, which the acknowledgement's detail says.
        Offset = 10, "the chunk does not begin where the last one ended";
        /// The image is empty, no whole words, longer than a slot, or not all there.
        Length = 11, "the image's length does not fit";
        /// No update was begun.
        NoUpdate = 12, "no update was begun";
        /// An update is being erased or checked, or has to wait until the outputs coast; ask again.
        Busy = 13, "the update is being erased or checked, or waits for the outputs to coast; ask again";
        /// The checksum of what was written is not the one announced.
        Checksum = 14, "the image's checksum is not the one announced";
        /// The signature is missing or not by the key of this build.
        Signature = 15, "the signature is missing or not by this build's key";
        /// The image's version is lower than one that was confirmed.
        Rollback = 16, "the image's version is lower than one that ran before";
        /// The flash cannot be erased or written.
        Flash = 17, "the flash cannot be erased or written";
        /// This end does not do that.
        Unsupported = 18, "the controller does not do that";
        /// The image is refused by the kernels, or its lengths are not those of the controller.
        Unfit = 19, "the image is not one that this controller can run";
        /// A break or overrun has not been cleared.
        Hardware = 20, "the hardware reports a fault";
        /// An axis has no finite limits, by the image that is built in or by the build.
        Limits = 21, "an axis has no limits, so nothing may move; build the firmware with --limits LOW:HIGH, or with an image \
            whose actions have low and high";
    }
}

impl core::error::Error for Refusal {}

codes! {
    /// Why the processor started.
    ResetCause {
        /// The cause is not known.
        Unknown = 0, "unknown";
        /// Power came on.
        Power = 1, "power on";
        /// The reset pin.
        Pin = 2, "reset pin";
        /// The watchdog.
        Watchdog = 3, "watchdog";
        /// The software asked for it.
        Software = 4, "software";
        /// The supply voltage was too low.
        Brownout = 5, "brown-out";
    }
}

codes! {
    /// What the firmware was last seen to die of.
    Crash {
        /// A panic.
        Panic = 1, "panic";
        /// A hard fault or another exception that nothing handles.
        HardFault = 2, "hard fault";
        /// The stack grew beyond its limit.
        StackOverflow = 3, "stack overflow";
        /// The watchdog was about to reset: what made no progress is in the record's detail.
        Watchdog = 4, "no progress, watchdog";
    }
}

codes! {
    /// What can be read and, while not armed, set. Values are f32; counts are whole numbers.
    Parameter {
        /// Ticks without a good observation, or without an action, after which the safe action follows.
        Deadline = 1, "deadline in ticks";
        /// Age in µs, against the fastest delivery seen, above which an observation is refused.
        MaxAge = 2, "oldest observation in µs";
        /// Ticks between two status reports; 0 sends none unasked but that of a new token.
        StatusPeriod = 3, "ticks between status reports";
        /// Lower limit of an axis.
        Low = 4, "lower limit";
        /// Upper limit of an axis.
        High = 5, "upper limit";
        /// Largest change of an axis in one tick.
        Rate = 6, "largest change in a tick";
        /// Value from which an axis' first action after arming is rate-limited.
        Start = 7, "value at the start";
    }
}

codes! {
    /// What can be asked for.
    Report {
        /// [`crate::report::Status`].
        Status = 1, "status";
        /// [`crate::report::Timing`].
        Timing = 2, "timing";
        /// [`crate::report::Breadcrumb`].
        Breadcrumb = 3, "breadcrumb";
    }
}

/// An optional code: 0 is none. The outer `None` is an unknown number.
pub(crate) fn optional<T>(code: u8, from_code: impl Fn(u8) -> Option<T>) -> Option<Option<T>> {
    if code == 0 { Some(None) } else { from_code(code).map(Some) }
}
