//! The command `actq` as other tools call it: exit status, messages, files, and the pipe protocol.

mod bundle;
mod constants;
mod eval;
mod export_c;
mod fixture;
mod inputs;
mod inspect;
mod interrupts;
mod jobs;
mod policies;
mod quantize;
mod refusals;
mod serve;
mod sweep;
