//! Names of the code numbers in messages. A number keeps its meaning in all versions.

use core::fmt;

use crate::fields::{Field, Reader, Writer};

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal, $text:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $code,)*
        }

        impl $name {
            /// All variants, in order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Returns the number on the wire.
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// Returns the variant with this number, or `None` for an unknown number.
            pub fn from_code(code: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| one.code() == code)
            }
        }

        impl Field<'_> for $name {
            fn write(&self, w: &mut Writer<'_>) {
                self.code().write(w);
            }

            fn read(r: &mut Reader<'_>) -> Option<Self> {
                Self::from_code(r.field()?)
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
    /// State of the controller's outputs.
    State {
        /// Outputs coast.
        Disarmed = 0, "disarmed";
        /// Outputs follow the head.
        Armed = 1, "armed";
        /// Outputs do each axis' safe action until the controller is armed again or disarmed.
        Latched = 2, "latched in the safe action";
    }
}

codes! {
    /// Cause of the safe action of an armed controller.
    Fault {
        /// No valid observation arrived within the deadline.
        Stale = 1, "no valid observation arrived within the deadline";
        /// Observations arrived, but no action within the deadline.
        Late = 2, "the head produced no action within the deadline";
        /// The head ended a step with an error.
        Head = 3, "the head ended a step with an error";
        /// The number of values in an action differs from the number of axes.
        ActionLength = 4, "an action's number of values differs from the number of axes";
        /// A value in an action is NaN or infinite.
        ActionNotFinite = 5, "a value in an action is not finite";
        /// The checksum of the image in flash changed.
        Image = 6, "the image in flash changed: its checksum differs";
        /// The clock failed.
        Clock = 7, "the clock failed";
        /// The watchdog is not running.
        Watchdog = 8, "the watchdog is not running";
        /// A control tick ended after the next tick was due.
        Overrun = 9, "a control tick took longer than its period";
        /// The hardware's break input switched the outputs off.
        Break = 10, "the break input switched the outputs off";
        /// A bit of the controller's state or limits in memory changed: a restart is necessary.
        Memory = 11, "the controller's state or limits in memory changed; restart it";
        /// The image reads a prefix, and it is missing or its lifetime is over.
        Prefix = 12, "the policy's prefix is missing, or its lifetime is over";
    }
}

codes! {
    /// Reason for refusing a request.
    Refusal {
        /// The request's token differs from the token in the last status: the request is older than the controller's
        /// state.
        Token = 1, "the token differs from the token in the last status; read the status and repeat the request";
        /// The controller has no valid image.
        Image = 2, "the controller has no valid image";
        /// The image's self-test failed.
        SelfTest = 3, "the image's self-test failed";
        /// The clock failed.
        Clock = 4, "the clock failed";
        /// The watchdog is not running.
        Watchdog = 5, "the watchdog is not running";
        /// No valid observation arrived within the deadline.
        Stale = 6, "no valid observation arrived within the deadline; send observations before arming";
        /// The controller is armed, or, for a request that needs the disarmed state, latched.
        Armed = 7, "the controller is armed or latched; disarm it first";
        /// Unknown parameter or axis.
        Parameter = 8, "unknown parameter or axis";
        /// The value is not finite or is outside the parameter's range.
        Range = 9, "the value is not finite or is outside the parameter's range";
        /// The chunk does not begin at the end of the last one; [`Message::Ack`](crate::Message::Ack) names that
        /// offset.
        Offset = 10, "the chunk does not begin at the end of the last one";
        /// The image is empty, not whole words, longer than a slot, or incomplete.
        Length = 11, "the image is empty, incomplete, not whole words, or longer than a slot";
        /// No update is in progress.
        NoUpdate = 12, "no update is in progress";
        /// The update's slot is being erased or checked, or the outputs do not coast yet; repeat the request.
        Busy = 13, "the update is being erased or checked, or waits for the outputs to coast; repeat the request";
        /// The checksum of the written bytes differs from the announced one.
        Checksum = 14, "the image's checksum differs from the announced one";
        /// The signature is missing or was not made with the key of this build.
        Signature = 15, "the signature is missing or was not made with the key of this build";
        /// The image's version is lower than a confirmed one.
        Rollback = 16, "the image's version is lower than that of an image that already ran";
        /// The flash cannot be erased or written.
        Flash = 17, "the flash cannot be erased or written";
        /// The controller does not support the request.
        Unsupported = 18, "the controller does not support this request";
        /// The kernels refuse the image, or its input and output lengths do not match the controller.
        Unfit = 19, "this controller cannot run the image";
        /// The break input is active, a break or an overrun latched and the controller was not disarmed since, or its
        /// memory changed.
        Hardware = 20, "the break input is active, or a break or an overrun latched: remove the cause, disarm, and then arm; or the \
            memory changed: restart";
        /// An axis has no finite limits, neither from the built-in image nor from the build, or too small a rate.
        Limits = 21, "an axis has no limits or too small a rate, so no output may move; build the firmware with --limits LOW:HIGH, or with an image \
            whose actions have low and high";
        /// The image reads a prefix, and it is missing or its lifetime is over.
        Prefix = 22, "the policy's prefix is missing, or its lifetime is over; send a prefix before arming";
    }
}

impl core::error::Error for Refusal {}

codes! {
    /// Cause of the processor's last reset.
    ResetCause {
        /// The cause is not known.
        Unknown = 0, "unknown";
        /// Power-on.
        Power = 1, "power on";
        /// The reset pin.
        Pin = 2, "reset pin";
        /// The watchdog.
        Watchdog = 3, "watchdog";
        /// A request by the software.
        Software = 4, "software";
        /// The supply voltage was too low.
        Brownout = 5, "brown-out";
    }
}

codes! {
    /// Kind of the firmware's last crash.
    Crash {
        /// A panic.
        Panic = 1, "panic";
        /// A hard fault or another unhandled exception.
        HardFault = 2, "hard fault";
        /// The stack grew beyond its limit.
        StackOverflow = 3, "stack overflow";
        /// The watchdog was about to reset; the record's detail names the stalled parts.
        Watchdog = 4, "no progress, watchdog";
    }
}

codes! {
    /// A parameter, which can be read at any time and set while disarmed. Values are f32; counts are whole numbers.
    Parameter {
        /// Ticks without a valid observation, or without an action, before the safe action.
        Deadline = 1, "deadline in ticks";
        /// Largest age of an observation in µs, relative to the fastest delivery seen; older ones are refused.
        MaxAge = 2, "oldest observation in µs";
        /// Ticks between two status reports. With 0, the only unrequested report is that of a new token.
        StatusPeriod = 3, "ticks between status reports";
        /// Lower limit of an axis.
        Low = 4, "lower limit";
        /// Upper limit of an axis.
        High = 5, "upper limit";
        /// Largest change of an axis in one tick.
        Rate = 6, "largest change in a tick";
        /// Value of an axis at arming, from which its first action is rate-limited.
        Start = 7, "value at the start";
    }
}

codes! {
    /// A report that a host can request.
    Report {
        /// [`crate::report::Status`].
        Status = 1, "status";
        /// [`crate::report::Timing`].
        Timing = 2, "timing";
        /// [`crate::report::Breadcrumb`].
        Breadcrumb = 3, "breadcrumb";
    }
}

macro_rules! optional {
    ($($name:ident)*) => {
        // 0 is none.
        $(impl Field<'_> for Option<$name> {
            fn write(&self, w: &mut Writer<'_>) {
                self.map_or(0, $name::code).write(w);
            }

            fn read(r: &mut Reader<'_>) -> Option<Self> {
                match r.field()? {
                    0 => Some(None),
                    code => $name::from_code(code).map(Some),
                }
            }
        })*
    };
}
optional! { Fault Refusal Crash }
