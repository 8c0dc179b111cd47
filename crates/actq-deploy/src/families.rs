//! The families that this crate reads. To add one, append it to [`FAMILIES`]: the text of a profile with a `[stack]` table,
//! or a reader in code.

mod common;
mod humanoidverse;
mod isaaclab;
mod kinfer;
mod leapp;
mod lerobot;
mod limx;
mod mjlab;
mod rl_sar;
mod stack;
mod tensors;

pub(crate) use self::common::metadata_document;
pub(crate) use self::stack::{Schema, Stack};
use crate::family::Family;

/// All families; the first that recognizes a bundle reads it.
pub(crate) static FAMILIES: &[&dyn Family] = &[
    &limx::Limx,
    &Stack(include_str!("families/unitree_rl_lab.toml")),
    &rl_sar::RlSar,
    &humanoidverse::Humanoidverse,
    &Stack(include_str!("families/holosoma.toml")),
    &kinfer::Kinfer,
    &leapp::Leapp,
    &isaaclab::IsaacLab,
    &mjlab::Mjlab,
    &lerobot::Lerobot,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::Profile;

    #[test]
    fn every_rule_has_one_of_its_choices() {
        for family in FAMILIES {
            let profile = Profile::parse(family.profile()).expect("a profile");
            for rule in profile.rules.iter().filter(|rule| !rule.choices.is_empty()) {
                let is_choice = |value: &toml::Value| rule.choices.iter().any(|choice| value.as_str() == Some(choice));
                assert!(rule.value.as_ref().is_none_or(is_choice), "{}: {}", profile.family, rule.key);
            }
        }
    }
}
