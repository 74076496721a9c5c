//! Ctrl-C and SIGTERM: what there is is written, marked partial.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{Run, Sandbox};

/// A bake that takes minutes.
const LONG: [&str; 8] = [
    "bake",
    "builtin:ring",
    "-o",
    "out",
    "--density",
    "1e8",
    "--map-resolution",
    "32",
];

fn start(sandbox: &Sandbox) -> Child {
    let child = sandbox
        .command(&LONG)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // The folder is made just before the bake; then the first rays are let through.
    let patience = Instant::now();
    while !sandbox.path("out/maps").exists() {
        assert!(
            patience.elapsed() < Duration::from_secs(60),
            "the bake never started"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status()
        .expect("kill starts");
    assert!(sent.success(), "the bake had ended already");
}

#[test]
fn the_first_signal_keeps_what_there_is() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let sandbox = Sandbox::new();
        let child = start(&sandbox);
        let sent = Instant::now();
        send(signal, &child);
        let run = Run::from(child.wait_with_output().expect("it ends"));
        assert_eq!(run.code, code, "{}", run.stderr);
        assert!(
            sent.elapsed() < Duration::from_secs(20),
            "{signal} took {:?}",
            sent.elapsed()
        );
        let manifest = sandbox.manifest("out");
        assert_eq!(manifest["partial"], true);
        assert_eq!(manifest["stop_reason"], "cancelled");
        let listed = manifest["maps"].as_array().expect("maps").len();
        assert_eq!(listed, sandbox.files("out/maps").len());
        assert!(run.stdout.contains("partial"), "{}", run.stdout);
    }
}
