//! The tests of more than one crate: one binary, so that cargo links one, and the tests share their builds.

mod accuracy;
#[path = "../../../kernels/tests/common/attention.rs"]
mod attention;
mod budgets;
mod c_ports;
mod checksums;
mod cli;
mod constants;
mod controller;
mod denoising;
mod deployed;
mod digests;
mod docs;
#[path = "../../../kernels/tests/common/draft.rs"]
mod draft;
mod drive;
mod faults;
mod folder;
mod format;
mod learning;
mod left_out;
mod malformed;
mod memory;
mod on_target;
mod ops;
mod outputs;
mod parity;
mod playback;
mod prefix;
mod recordings;
mod slices;
mod smoke;
mod stats;
mod surface;
