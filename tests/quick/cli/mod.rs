//! The program as a user runs it: options, streams, exit codes, files.

mod inspect;
mod smoke;
mod usage;

use std::process::Command;

use support::program::Sandbox;

/// The program where loaders of Vulkan and OpenGL find no driver: the CPU makes its pictures.
fn without_card(sandbox: &Sandbox, line: &str) -> Command {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut command = sandbox.command(&arguments);
    for list in [
        "__EGL_VENDOR_LIBRARY_FILENAMES",
        "__EGL_VENDOR_LIBRARY_DIRS",
        "VK_ICD_FILENAMES",
        "VK_DRIVER_FILES",
    ] {
        command.env(list, "/nonexistent.json");
    }
    command
}
