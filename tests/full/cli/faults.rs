//! What may befall a run: full disks, limits, streams that take nothing, Ctrl-C, SIGTERM and SIGKILL. Files are whole or
//! not there, and marked where they are partial.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nephroid::export::FloatImage;

use support::prelude::*;
use support::program::{Run, Sandbox};

const QUICK: &str = "--density 1e3 --map-resolution 64";

/// Runs the program in a shell that sets a limit first.
fn run_under(limit: &str, sandbox: &Sandbox, line: &str) -> Run {
    let program = sandbox.command(&[]);
    let mut shell = Command::new("sh");
    shell
        .args(["-c", &format!("{limit} && exec \"$0\" {line}")])
        .arg(program.get_program())
        .current_dir(sandbox.path("."))
        .stdin(Stdio::null());
    for (name, value) in program.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    Run::from(shell.output().expect("a shell starts"))
}

/// Every file below a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("it can be listed") {
        let path = entry.expect("it can be listed").path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.insert(path.clone(), std::fs::read(&path).expect("it can be read"));
        }
    }
    found
}

#[test]
fn a_full_disk_leaves_what_was_there() {
    let sandbox = Sandbox::new();
    let fails = |line: &str, file: &str| {
        let before = contents(&sandbox.path("."));
        // Blocks of 512 bytes.
        let run = run_under("ulimit -f 4", &sandbox, line);
        run.failed_in_one_sentence(1, &[file, "larger than files may be"]);
        assert!(contents(&sandbox.path(".")) == before, "{line}");
    };
    // A map without noise is larger than the limit.
    let bake = "bake builtin:mirror -o out --max-error 2% --map-resolution 64";
    fails(bake, ".exr");
    assert_eq!(sandbox.files("."), [""; 0], "a failed bake leaves nothing");
    sandbox.succeed(bake);
    fails("export out --format hdr -o t", "t/0000_floor.hdr");
    assert_eq!(sandbox.files("."), ["out"], "nor does a failed export");
    sandbox.succeed("export out -o lit.glb");
    sandbox.succeed("export out --format exr -o t");
    let render = "render builtin:mirror --backend cpu --maps out";
    for (line, file) in [
        (
            "bake builtin:mirror -o out --density 2e3 --map-resolution 128",
            ".exr",
        ),
        (&format!("{render} -o a.exr --size 80x60"), "a.exr"),
        (&format!("{render} -o a.png --size 320x200"), "a.png"),
        ("export out -o lit.glb --units E", "lit.glb"),
        ("export out --format exr --bits 32 -o t", "t/0000_floor.exr"),
    ] {
        fails(line, file);
    }
}

#[test]
fn little_address_space_is_told() {
    let sandbox = Sandbox::new();
    let line = "bake builtin:ring -o out --density 100 --map-resolution 256 --threads 2";
    for (limit_kb, lines) in [(1_500_000, 1), (60_000_000, 0)] {
        let run = run_under(&format!("ulimit -v {limit_kb}"), &sandbox, line);
        assert_eq!(run.code, 0, "{}", run.stderr);
        let told = run.stderr.lines().filter(|line| line.contains("ulimit -v"));
        assert_eq!(told.count(), lines, "{}", run.stderr);
    }
}

/// Under a limit that the program starts with and a large map does not fit in.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_refused_is_told() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let before = contents(&sandbox.path("."));
    let line = "bake builtin:mirror -o out --max-error 5% --map-resolution 16384 --threads 1";
    let run = run_under("ulimit -v 450000", &sandbox, line);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let errors: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    let [sentence] = errors[..] else {
        panic!("not one sentence: {}", run.stderr)
    };
    for word in ["the system refused", "--map-resolution"] {
        assert!(sentence.contains(word), "{sentence}");
    }
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    assert!(contents(&sandbox.path(".")) == before);
}

/// A cache that cannot be kept costs time and nothing else.
#[test]
fn a_cache_below_a_file_is_no_cache() {
    let sandbox = Sandbox::new();
    let file = sandbox.write("file", "kept");
    let bake = format!("bake builtin:ball -o out {QUICK}");
    let mut command = sandbox.command(&bake.split_whitespace().collect::<Vec<_>>());
    command.env("XDG_CACHE_HOME", &file);
    let run = Run::from(command.output().expect("the program starts"));
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    assert_eq!(std::fs::read(file).expect("there"), b"kept");
}

#[cfg(target_os = "linux")]
#[test]
fn streams_that_take_nothing_stop_no_work() {
    let full = || {
        let file = File::options().write(true).open("/dev/full");
        Stdio::from(file.expect("Linux has one"))
    };
    let sandbox = Sandbox::new();
    let bake = format!("bake builtin:mirror -o out --memory 1M {QUICK}");
    let mut command = sandbox.command(&bake.split_whitespace().collect::<Vec<_>>());
    let status = command.stdout(Stdio::null()).stderr(full()).status();
    assert_eq!(status.expect("the program starts").code(), Some(0));
    assert_eq!(sandbox.manifest("out")["partial"], false);
    // Results that cannot be written are a failure.
    let mut command = sandbox.command(&["inspect", "builtin:ring"]);
    let output = command.stdout(full()).output().expect("the program starts");
    Run::from(output).failed_in_one_sentence(1, &["stdout"]);
    // Nor is it a panic where there is nobody to tell of a failure.
    let mut command = sandbox.command(&["inspect", "missing.glb"]);
    let status = command.stdout(full()).stderr(full()).status();
    assert_eq!(status.expect("the program starts").code(), Some(1));
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let sandbox = Sandbox::new();
    let mut child = sandbox
        .command(&["inspect", "builtin:ring", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let run = Run::from(child.wait_with_output().expect("it ends"));
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
}

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
        // A bake that takes an hour.
        let child = start(
            &sandbox,
            "bake builtin:ring -o out --density 1e10 --map-resolution 32",
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
