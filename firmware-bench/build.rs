//! Links for the board of the target.

fn main() {
    actq_boards::link();
}
