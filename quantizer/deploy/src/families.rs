//! The families that this crate reads. To add one, append it to [`FAMILIES`].

mod common;
mod holosoma;
mod humanoidverse;
mod isaaclab;
mod kinfer;
mod leapp;
mod lerobot;
mod limx;
mod mjlab;
mod rl_sar;
mod tensors;
mod unitree_rl_lab;

use crate::family::Family;

/// All families; the first that recognizes a bundle reads it.
pub(crate) static FAMILIES: &[&dyn Family] = &[
    &limx::Limx,
    &unitree_rl_lab::UnitreeRlLab,
    &rl_sar::RlSar,
    &humanoidverse::Humanoidverse,
    &holosoma::Holosoma,
    &kinfer::Kinfer,
    &leapp::Leapp,
    &isaaclab::IsaacLab,
    &mjlab::Mjlab,
    &lerobot::Lerobot,
];
