//! Human-readable tables.

use comfy_table::{CellAlignment, Table, presets};

/// Creates a table without borders, with all columns but the first right-aligned.
pub fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Formats a group size.
pub fn group_name(group: usize) -> String {
    if group == 0 { "row".to_owned() } else { group.to_string() }
}
