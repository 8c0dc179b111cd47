//! The host's end of the link with a simulated controller, over a socket and a faulty line.

mod keys;
mod pushes;
mod requests;
mod serves;
mod simulated;
mod streams;
