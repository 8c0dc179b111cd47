//! The host's end of the link against a simulated controller, over a socket and a bad line.

mod keys;
mod line;
mod pushes;
mod requests;
mod serves;
mod simulated;
mod streams;
