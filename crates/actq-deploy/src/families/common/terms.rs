//! Terms that humanoidverse and holosoma both have.

/// Returns the length and the unit of a term that the application gives under its own name.
pub(crate) fn given(term: &str) -> Option<(usize, &'static str)> {
    Some(match term {
        "base_ang_vel" => (3, "rad/s"),
        "base_lin_vel" => (3, "m/s"),
        "command_lin_vel" => (2, "m/s"),
        "command_ang_vel" => (1, "rad/s"),
        "command_stand" => (1, "1 to walk, 0 to stand"),
        "command_base_height" => (1, "m"),
        "command_waist_dofs" => (3, "rad"),
        _ => return None,
    })
}
