//! The families that this crate reads. To add one, append it to [`FAMILIES`].

mod common;
mod unitree_rl_lab;

use crate::family::Family;

/// All families; the first that recognizes a bundle reads it.
pub static FAMILIES: &[&dyn Family] = &[&unitree_rl_lab::UnitreeRlLab];
