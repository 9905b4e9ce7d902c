//! What SPOTs cost: time per shade, bytes per question, memory in a hall of mirrors.
//!
//! `cargo run --release -p kilauea-spot --example cost [shade | hall | delay]`
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod mirrors;
mod shade;
#[path = "../../tests/support/mod.rs"]
mod support;

fn main() {
    let which = std::env::args().nth(1);
    let is_wanted = |name| which.as_deref().is_none_or(|w| w == name);
    if is_wanted("shade") {
        shade::report();
    }
    if is_wanted("hall") {
        mirrors::report_memory();
    }
    if is_wanted("delay") {
        mirrors::report_delays();
    }
}
