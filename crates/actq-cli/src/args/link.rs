//! The command line of `actq link`, `actq keygen` and `actq sign`.

use std::path::PathBuf;
use std::time::Duration;

use actq_client::port::Address;
use actq_link::code::Parameter;
use anyhow::{Result, ensure};
use clap::{Subcommand, ValueEnum};

use super::values::finite;

#[derive(clap::Args)]
pub(crate) struct LinkArgs {
    #[command(subcommand)]
    pub(crate) command: LinkCommand,
}

#[derive(Subcommand)]
pub(crate) enum LinkCommand {
    /// List the serial ports
    Ports,
    /// Show state, counters and times, and update them until the command ends
    Watch {
        #[command(flatten)]
        port: PortArgs,
        /// Show one table and end
        #[arg(long)]
        once: bool,
    },
    /// Let the actions drive the outputs; something must already send observations to the controller
    Arm(PortArgs),
    /// Let the outputs coast
    Disarm(PortArgs),
    /// Read a parameter
    Get(GetArgs),
    /// Set a parameter, while disarmed
    Set {
        #[command(flatten)]
        of: GetArgs,
        /// The value
        #[arg(allow_negative_numbers = true, value_parser = finite)]
        value: f32,
    },
    /// Send a recording's observations at their rate
    ///
    /// IMAGE must be the image that the controller runs. It gives the length of an observation, and the command
    /// compares its checksum. Episodes follow each other without a reset.
    ///
    /// Example: actq link stream /dev/ttyACM0 ur3.actq heldout.npz --arm --log drive.npz
    Stream(StreamArgs),
    /// Use the controller as a simulator's policy, by the protocol of `actq serve` on standard input and output
    ///
    /// A reset disarms, which resets the head. Without --arm the outputs coast, and the head still gives actions.
    Serve {
        #[command(flatten)]
        port: PortArgs,
        /// Arm at the first step of an episode
        #[arg(long)]
        arm: bool,
    },
    /// Send an image into the slot that does not run, then run it
    ///
    /// Example: actq link push /dev/ttyACM0 ur3.actq --signature ur3.sig
    Push(PushArgs),
}

#[derive(clap::Args)]
pub(crate) struct PortArgs {
    /// A serial port, as /dev/ttyACM0, COM3 or /dev/ttyUSB0@115200 [default rate: 921600 bits per second], or a socket:
    /// tcp:HOST:PORT or unix:PATH
    pub(crate) port: Address,
    /// Seconds to wait for an answer, and for a lost port to return
    #[arg(long, alias = "patience", value_name = "SECONDS", default_value = "5", value_parser = seconds)]
    pub(crate) timeout: Duration,
}

/// A parameter's name.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum ParameterArg {
    /// Ticks without a good observation or action, before the safe action
    Deadline,
    /// Largest observation age, in µs
    MaxAge,
    /// Ticks between two status reports; 0 = none
    StatusPeriod,
    /// Lower limit of an axis
    Low,
    /// Upper limit of an axis
    High,
    /// Largest change of an axis in a tick
    Rate,
    /// Value from which the rate limit of an axis' first action counts
    Start,
}

impl From<ParameterArg> for Parameter {
    fn from(name: ParameterArg) -> Self {
        match name {
            ParameterArg::Deadline => Self::Deadline,
            ParameterArg::MaxAge => Self::MaxAge,
            ParameterArg::StatusPeriod => Self::StatusPeriod,
            ParameterArg::Low => Self::Low,
            ParameterArg::High => Self::High,
            ParameterArg::Rate => Self::Rate,
            ParameterArg::Start => Self::Start,
        }
    }
}

#[derive(clap::Args)]
pub(crate) struct GetArgs {
    #[command(flatten)]
    pub(crate) port: PortArgs,
    /// The parameter
    pub(crate) parameter: ParameterArg,
    /// The axis, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) axis: u8,
}

impl GetArgs {
    /// Returns the parameter and its axis.
    ///
    /// # Errors
    ///
    /// If an axis is given for a parameter that all axes share.
    pub(crate) fn checked(&self) -> Result<(Parameter, u8)> {
        let parameter = Parameter::from(self.parameter);
        let is_shared = matches!(parameter, Parameter::Deadline | Parameter::MaxAge | Parameter::StatusPeriod);
        ensure!(
            !is_shared || self.axis == 0,
            "--axis {}: the {parameter} is not of one axis; remove --axis",
            self.axis
        );
        Ok((parameter, self.axis))
    }
}

#[derive(clap::Args)]
pub(crate) struct StreamArgs {
    #[command(flatten)]
    pub(crate) port: PortArgs,
    /// The image that the controller runs
    pub(crate) image: PathBuf,
    /// The recording: .npz, .npy or .safetensors
    pub(crate) recording: PathBuf,
    /// Observations per second [default: the image's rate]
    #[arg(long, value_name = "HZ", value_parser = rate)]
    pub(crate) rate: Option<f64>,
    /// Arm as soon as observations flow, and disarm at the end
    #[arg(long)]
    pub(crate) arm: bool,
    /// Write a log of observations and replies: obs, action, applied, sent and received (seconds)
    #[arg(long, value_name = "FILE.npz")]
    pub(crate) log: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct PushArgs {
    #[command(flatten)]
    pub(crate) port: PortArgs,
    /// The image
    pub(crate) image: PathBuf,
    /// The image's version, at least the highest that the controller has run [default: the signature's, else 0]
    #[arg(long, value_name = "N", conflicts_with = "signature")]
    pub(crate) version: Option<u32>,
    /// The image's signature, by `actq sign`
    #[arg(long, value_name = "FILE")]
    pub(crate) signature: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct KeygenArgs {
    /// The file to write the private key to, readable by its owner only; an existing file is never replaced
    #[arg(long, value_name = "FILE.pem")]
    pub(crate) out: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct SignArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The private key, by `actq keygen` or `openssl genpkey -algorithm ed25519`
    #[arg(long, value_name = "FILE.pem")]
    pub(crate) key: PathBuf,
    /// The image's version; a controller that has run a higher one refuses it
    #[arg(long, value_name = "N")]
    pub(crate) version: u32,
    /// The file to write the signature to
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.1..=3600.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "use 0.1 to 3600 seconds".to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (0.1..=1000.0).contains(rate));
    rate.ok_or_else(|| "use 0.1 to 1000 observations per second".to_owned())
}
