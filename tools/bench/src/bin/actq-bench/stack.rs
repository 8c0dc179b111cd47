//! `cargo xtask stack`: computes the maximum stack of the application from the calls in its ELF file.

use std::path::Path;

use actq_bench::stack::{Priority, Worst, worst_case};
use actq_bench::{Target, firmware};
use actq_cli::report::table::table;
use anyhow::{Context as _, Result, ensure};

/// Shows the maximum stack of the application for a board.
pub(crate) fn of_board(name: &str) -> Result<()> {
    let target = Target::on(name).filter(|target| target.board().application.is_some());
    let target = target.with_context(|| {
        format!("the board {name:?} has no application; `cargo xtask firmware --list` shows the boards")
    })?;
    show(&firmware::controller(target, "")?)
}

/// Shows the maximum stack of the application in an ELF file.
pub(crate) fn show(elf: &Path) -> Result<()> {
    let worst = worst_case(elf)?;
    println!("{}", text(&worst));
    ensure!(worst.bytes() <= worst.room, "the stack needs {} bytes, but has room for {}", worst.bytes(), worst.room);
    Ok(())
}

fn text(worst: &Worst) -> String {
    let mut rows = table(&["function", "frame", "depth"]);
    let mut depth = 0;
    let mut row = |what: String, bytes: u32| {
        depth += bytes;
        rows.add_row([what, bytes.to_string(), depth.to_string()]);
    };
    for level in &worst.levels {
        match level.priority {
            Priority::Thread => {}
            Priority::Task(priority) => row(format!("above it, at priority {priority}:"), level.stacked),
            Priority::Fault => row("above it, a fault:".to_owned(), level.stacked),
            Priority::HardFault => row("above it, a hard fault:".to_owned(), level.stacked),
            Priority::Nmi => row("above it, the non-maskable interrupt:".to_owned(), level.stacked),
        }
        for call in &level.path {
            let by_pointer = if call.by_pointer { ", which calls by a pointer" } else { "" };
            row(format!("  {}{by_pointer}", call.function), call.frame);
        }
    }
    let list = |names: &[String]| names.iter().map(|name| format!("\n  {name}")).collect::<String>();
    format!(
        "{rows}\n\n{} bytes of stack at most, of {}\n\n{} functions, of which call by pointers:{}\nPointers may point to:{}",
        worst.bytes(),
        worst.room,
        worst.frames.len(),
        list(&worst.by_pointer),
        list(&worst.pointed_to),
    )
}
