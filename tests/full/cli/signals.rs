//! Ctrl-C, SIGTERM and SIGKILL: what is on the disk is whole, and marked where it is partial.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nephroid::export::FloatImage;
use serde_json::Value;

use support::program::{Run, Sandbox};

const QUICK: &str = "--density 1e3 --map-resolution 64";

/// Starts a bake and waits until its folder has other maps than before.
fn start(sandbox: &Sandbox, line: &str) -> Child {
    let before = sandbox.files("out/maps");
    let mut child = sandbox
        .command(&line.split_whitespace().collect::<Vec<_>>())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let is_there = sandbox.path("out/maps").exists();
    let has_begun = || match is_there {
        true => sandbox.files("out/maps") != before,
        // The folder is made just before the bake.
        false => sandbox.path("out/maps").exists(),
    };
    while child.try_wait().expect("it runs").is_none() && !has_begun() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

fn shell(line: &str) {
    let status = Command::new("sh").args(["-c", line]).status();
    assert!(
        status.expect("a shell starts").success(),
        "{line}: the bake had ended"
    );
}

/// Fails where a map is not whole, or one that the manifest names is not there.
#[track_caller]
fn assert_whole(folder: &Path) {
    let bytes = std::fs::read(folder.join("manifest.json")).expect("a manifest");
    let manifest: Value = serde_json::from_slice(&bytes).expect("the manifest is whole");
    for map in manifest["maps"].as_array().expect("maps") {
        let file = folder.join(map["file"].as_str().expect("a name"));
        assert!(file.exists(), "{} is named", file.display());
    }
    for file in std::fs::read_dir(folder.join("maps")).expect("a folder") {
        let file = file.expect("it can be listed").path();
        if file.extension().is_some_and(|kind| kind == "exr") {
            FloatImage::read(&file).expect("a whole map");
        }
    }
}

#[test]
fn the_first_signal_keeps_what_there_is() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let sandbox = Sandbox::new();
        // A bake that takes minutes.
        let child = start(
            &sandbox,
            "bake builtin:ring -o out --density 1e8 --map-resolution 32",
        );
        // The first rays are let through.
        std::thread::sleep(Duration::from_millis(500));
        shell(&format!("kill -{signal} {}", child.id()));
        let run = Run::from(child.wait_with_output().expect("it ends"));
        assert_eq!(run.code, code, "{}", run.stderr);
        let manifest = sandbox.manifest("out");
        assert_eq!(
            (&manifest["partial"], &manifest["stop_reason"]),
            (&true.into(), &"cancelled".into())
        );
        let listed = manifest["maps"].as_array().expect("maps").len();
        assert_eq!(listed, sandbox.files("out/maps").len());
        assert!(run.stdout.contains("partial"), "{}", run.stdout);
    }
}

/// It does not wait until the maps are written.
#[test]
fn the_second_signal_ends_at_once() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:showroom -o out {QUICK}"));
    let before = sandbox.manifest("out");
    let line = "bake builtin:showroom -o out --density 1e8 --map-resolution 1024 --quiet";
    let child = sandbox
        .command(&line.split_whitespace().collect::<Vec<_>>())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1500));
    let kill = format!("kill -INT {}", child.id());
    shell(&format!("{kill} && sleep 0.05 && {kill}"));
    let run = Run::from(child.wait_with_output().expect("it ends"));
    assert_eq!((run.code, run.stderr.as_str()), (130, ""));
    assert_eq!(sandbox.manifest("out"), before);
    assert_whole(&sandbox.path("out"));
}

/// No warning and no time to end.
#[test]
fn killed_while_it_writes_it_tears_nothing() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:slab -o out {QUICK}"));
    let mut killed = 0;
    for attempt in 0..60 {
        // From its first new file on.
        let line = "bake builtin:slab -o out --density 1e3 --map-resolution 1024 --quiet";
        let mut child = start(&sandbox, line);
        std::thread::sleep(Duration::from_millis(3 * (attempt % 6)));
        child.kill().expect("it is ours");
        // Some come too late: then all is written.
        killed += usize::from(!child.wait().expect("it ends").success());
        assert_whole(&sandbox.path("out"));
        if killed == 6 {
            break;
        }
    }
    assert_eq!(killed, 6, "times in time");
    sandbox.succeed(&format!("bake builtin:slab -o out {QUICK}"));
    assert_whole(&sandbox.path("out"));
}
