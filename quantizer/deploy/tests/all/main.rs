//! Bundles of every family against their deploy code, made bundles, and damaged ones.

mod bundles;
mod common;
mod holosoma;
mod humanoidverse;
mod images;
mod isaaclab;
mod kinfer;
mod leapp;
mod leapp_states;
mod lerobot;
mod lerobot_damaged;
mod mjlab;
mod plan;
mod references;
mod rl_sar;
mod unread;
