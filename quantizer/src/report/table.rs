//! Tables and the like for people.

use comfy_table::{CellAlignment, Table, presets};

/// A table without lines, numbers to the right.
pub fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Group size as text.
pub fn group_name(group: usize) -> String {
    if group == 0 { "row".to_owned() } else { group.to_string() }
}
