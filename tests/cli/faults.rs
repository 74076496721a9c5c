//! What the system may do to a run: disks that are full, limits, paths that cannot be, and death in the middle of it.
//! Files are whole or not there, and there is one clear sentence.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nephroid::export::FloatImage;

use crate::program::{Run, Sandbox};

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

/// What of a folder of maps is torn, if anything is: files that are not whole, or that the manifest only names.
fn torn(folder: &Path) -> Option<String> {
    let manifest = folder.join("manifest.json");
    let mut named = Vec::new();
    if manifest.exists() {
        let bytes = std::fs::read(&manifest).expect("it can be read");
        let Ok(document) = serde_json::from_slice::<serde_json::Value>(&bytes) else {
            return Some("the manifest is no JSON".into());
        };
        let maps = document["maps"].as_array().cloned().unwrap_or_default();
        named.extend(
            maps.iter()
                .filter_map(|map| Some(folder.join(map["file"].as_str()?))),
        );
    }
    if let Some(missing) = named.iter().find(|file| !file.exists()) {
        return Some(format!("{} is named and not there", missing.display()));
    }
    let files = std::fs::read_dir(folder.join("maps")).into_iter().flatten();
    let maps = files.map(|file| file.expect("it can be listed").path());
    let mut exrs = maps.filter(|file| file.extension().is_some_and(|kind| kind == "exr"));
    let bad = exrs.find(|file| FloatImage::read(file).is_err())?;
    Some(format!("{} is torn", bad.display()))
}

#[test]
fn torn_folders_are_noticed() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let out = sandbox.path("out");
    assert_eq!(torn(&out), None);
    let map = out.join(
        sandbox.manifest("out")["maps"][0]["file"]
            .as_str()
            .expect("a name"),
    );
    let whole = std::fs::read(&map).expect("it was written");
    std::fs::write(&map, &whole[..whole.len() / 2]).expect("writable");
    assert!(torn(&out).is_some_and(|what| what.contains("torn")));
    std::fs::remove_file(&map).expect("writable");
    assert!(torn(&out).is_some_and(|what| what.contains("not there")));
    std::fs::write(out.join("manifest.json"), "{\"maps\": [").expect("writable");
    assert!(torn(&out).is_some_and(|what| what.contains("no JSON")));
}

#[test]
fn a_disk_that_gets_full_leaves_what_was_there() {
    let sandbox = Sandbox::new();
    let full = |line: &str, file: &str| {
        let run = run_under("ulimit -f 4", &sandbox, line);
        run.failed_in_one_sentence(1, &[file, "larger than files may be"]);
    };
    let line = format!("bake builtin:mirror -o out {QUICK}");
    full(&line, ".exr");
    assert_eq!(sandbox.files("."), [""; 0], "a failed bake leaves nothing");
    sandbox.succeed(&line);
    let names = sandbox.files("out/maps");
    let manifest = std::fs::read(sandbox.path("out/manifest.json")).expect("it was written");
    full(
        "bake builtin:mirror -o out --density 2e3 --map-resolution 128",
        ".exr",
    );
    assert_eq!(torn(&sandbox.path("out")), None);
    assert_eq!(sandbox.files("out/maps"), names);
    assert_eq!(
        std::fs::read(sandbox.path("out/manifest.json")).expect("it is there"),
        manifest
    );
    // Pictures, and those of differences, alike.
    full(
        "render builtin:mirror -o a.exr --size 80x60 --backend cpu --maps out",
        "a.exr",
    );
    full(
        "render builtin:mirror -o a.png --size 320x200 --backend cpu --maps out",
        "a.png",
    );
    assert_eq!(sandbox.files("."), ["out"]);
}

#[test]
fn little_address_space_is_told_and_ends_no_run() {
    let sandbox = Sandbox::new();
    let line = "bake builtin:ring -o out --density 100 --map-resolution 256 --threads 2";
    let run = run_under("ulimit -v 1500000", &sandbox, line);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let told = run
        .stderr
        .lines()
        .filter(|line| line.contains("ulimit -v"))
        .count();
    assert_eq!(told, 1, "{}", run.stderr);
    assert_eq!(torn(&sandbox.path("out")), None);
    // With room enough nothing is said.
    let run = run_under("ulimit -v 60000000", &sandbox, line);
    assert!(run.code == 0 && !run.stderr.contains("ulimit"), "{}", run.stderr);
}

/// Under a limit that the program starts with and a large map does not fit in.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_refused_is_told_in_one_sentence() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let line = "bake builtin:mirror -o out --density 1e3 --map-resolution 8192 --threads 1";
    let run = run_under("ulimit -v 1000000", &sandbox, line);
    let errors: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    let is_told = matches!(errors[..], [sentence] if sentence.contains("the system refused") && sentence.contains("--map-resolution"));
    assert!(
        run.code == 1 && is_told && !run.stderr.contains("panicked"),
        "{run:?}"
    );
    assert_eq!(torn(&sandbox.path("out")), None);
    assert_eq!(
        sandbox.manifest("out")["maps"][0]["width"],
        64,
        "what was there is there"
    );
}

/// No warning and no time to end: what is on the disk is whole all the same.
#[cfg(unix)]
#[test]
fn killed_while_it_writes_it_leaves_nothing_torn() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:slab -o out {QUICK}"));
    let line = "bake builtin:slab -o out --density 1e3 --map-resolution 1024 --quiet";
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut killed = 0;
    for attempt in 0..60 {
        let before = sandbox.files("out/maps");
        let mut child = sandbox
            .command(&arguments)
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        // From its first new file on.
        while child.try_wait().expect("it runs").is_none() && sandbox.files("out/maps") == before {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(3 * (attempt % 6)));
        child.kill().expect("it is ours");
        killed += usize::from(!child.wait().expect("it ends").success());
        assert_eq!(torn(&sandbox.path("out")), None, "at attempt {attempt}");
        // Some come too late: then all is written.
        if killed == 6 {
            break;
        }
    }
    assert_eq!(killed, 6, "times in time");
    sandbox.succeed(&format!("bake builtin:slab -o out {QUICK}"));
    assert_eq!(torn(&sandbox.path("out")), None);
}

#[test]
fn nothing_is_read_or_written_below_a_file() {
    let sandbox = Sandbox::new();
    sandbox.write("file", "kept");
    let bake = "builtin:mirror --density 1e12";
    for line in [
        "inspect file/below.glb".to_owned(),
        "inspect builtin:mirror --environment file/below.hdr".to_owned(),
        "render builtin:mirror -o a.png --backend cpu --maps file/below".to_owned(),
        format!("render {bake} -o file/below.png"),
        format!("bake {bake} -o file/below"),
        "compare file/below.exr file/below.exr".to_owned(),
        "study convergence builtin:mirror -o file/below".to_owned(),
        "study reference builtin:mirror --rays 1e9 -o file/below".to_owned(),
        "study effects builtin:mirror -o file/below".to_owned(),
    ] {
        sandbox.run(&line).failed_in_one_sentence(1, &["file/below"]);
    }
    assert_eq!(sandbox.files("."), ["file"]);
    assert_eq!(std::fs::read(sandbox.path("file")).expect("there"), b"kept");
}

/// A cache that cannot be kept costs time and nothing else.
#[test]
fn a_cache_below_a_file_is_no_cache() {
    let sandbox = Sandbox::new();
    sandbox.write("file", "kept");
    let line = format!("bake builtin:ball -o out {QUICK}");
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut command = sandbox.command(&arguments);
    command.env("XDG_CACHE_HOME", sandbox.path("file"));
    let run = Run::from(command.output().expect("the program starts"));
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    assert_eq!(std::fs::read(sandbox.path("file")).expect("there"), b"kept");
}

#[cfg(target_os = "linux")]
#[test]
fn streams_that_take_nothing_stop_no_work() {
    let sandbox = Sandbox::new();
    let full = || {
        std::fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("Linux has one")
    };
    let line = format!("bake builtin:mirror -o out --memory 1M {QUICK}");
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut command = sandbox.command(&arguments);
    let output = command
        .stderr(Stdio::from(full()))
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(torn(&sandbox.path("out")), None);
    // Nor is it a panic where there is nobody to tell of a failure.
    let mut command = sandbox.command(&["inspect", "missing.glb"]);
    command.stdout(Stdio::from(full())).stderr(Stdio::from(full()));
    assert_eq!(command.status().expect("the program starts").code(), Some(1));
}

/// The second signal does not wait for anything.
#[cfg(unix)]
#[test]
fn the_second_signal_ends_at_once_and_tears_nothing() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:showroom -o out {QUICK}"));
    let line = "bake builtin:showroom -o out --density 1e8 --map-resolution 512 --quiet";
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut child = sandbox
        .command(&arguments)
        .stdout(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1500));
    let pid = child.id().to_string();
    for _ in 0..2 {
        let sent = Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .expect("kill starts");
        assert!(sent.success());
    }
    let start = Instant::now();
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    assert_eq!(torn(&sandbox.path("out")), None);
}

#[test]
fn an_export_that_does_not_fit_leaves_the_one_before() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    sandbox.succeed("export out -o lit.glb");
    let whole = std::fs::read(sandbox.path("lit.glb")).expect("it is there");
    let before = sandbox.files(".");
    // Blocks of 512 bytes.
    let run = run_under("ulimit -f 4", &sandbox, "export out -o lit.glb --units E");
    run.failed_in_one_sentence(1, &["lit.glb"]);
    assert_eq!(std::fs::read(sandbox.path("lit.glb")).ok(), Some(whole));
    assert_eq!(sandbox.files("."), before, "nothing lies beside it");
}

#[test]
fn textures_that_do_not_fit_leave_those_before() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let run = run_under("ulimit -f 4", &sandbox, "export out --format hdr -o t");
    run.failed_in_one_sentence(1, &["t/0000_floor.hdr", "larger than files may be"]);
    assert_eq!(sandbox.files("."), ["out"], "a failed export leaves nothing");
    sandbox.succeed("export out --format exr -o t");
    let before = sandbox.files("t");
    let bytes = |name: &str| std::fs::read(sandbox.path("t").join(name)).expect("it is there");
    let (index, texture) = (bytes("index.json"), bytes("0000_floor.exr"));
    let run = run_under("ulimit -f 4", &sandbox, "export out --format exr --bits 32 -o t");
    run.failed_in_one_sentence(1, &["t/0000_floor.exr"]);
    assert_eq!(sandbox.files("t"), before, "nothing lies beside them");
    assert_eq!((bytes("index.json"), bytes("0000_floor.exr")), (index, texture));
}
