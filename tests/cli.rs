//! The program from outside: what it writes, what it says, and how it exits.

#[path = "cli/bad_input.rs"]
mod bad_input;
#[path = "cli/colours.rs"]
mod colours;
#[path = "cli/extract.rs"]
mod extract;
#[path = "cli/mesh_tools.rs"]
mod mesh_tools;
#[path = "cli/methods.rs"]
mod methods;
#[path = "cli/other.rs"]
mod other;
#[path = "cli/points.rs"]
mod points;
#[path = "cli/program.rs"]
mod program;
#[path = "cli/scenes.rs"]
mod scenes;
#[path = "cli/targets.rs"]
mod targets;
