//! Links for the board.

fn main() -> Result<(), String> {
    actq_boards::link()
}
