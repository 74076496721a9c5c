//! Runs the program in a sandbox.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

use crate::prelude::*;

/// An empty working folder for the program, and a cache folder for it and its drivers. Both are removed at the end.
pub struct Sandbox {
    folder: TempDir,
    cache: TempDir,
}

/// Path of this build's program.
pub fn program() -> PathBuf {
    crate::build_folder().join(format!("nephroid{}", std::env::consts::EXE_SUFFIX))
}

/// Result of a run.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Sandbox {
    pub fn new() -> Self {
        let [folder, cache] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
        Self { folder, cache }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, contents).expect("the sandbox can be written");
        path
    }

    /// Writes a one-channel PFM, row by row.
    pub fn write_pfm(&self, name: &str, width: usize, height: usize, value: impl Fn(usize, usize) -> f32) {
        let mut bytes = format!("Pf\n{width} {height}\n-1.0\n").into_bytes();
        for row in 0..height {
            for column in 0..width {
                bytes.extend(value(column, row).to_le_bytes());
            }
        }
        self.write(name, bytes);
    }

    /// A command that starts the program in the sandbox, without a display.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(program());
        command
            .args(arguments)
            .current_dir(self.folder.path())
            // Without this variable, libraries of the window system print warnings to stderr.
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .env("XDG_CACHE_HOME", self.cache.path())
            .stdin(Stdio::null());
        for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(display);
        }
        command
    }

    /// Runs the program with arguments separated by spaces.
    pub fn run(&self, line: &str) -> Run {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        Run::from(self.command(&arguments).output().expect("the program starts"))
    }

    /// Runs the program and asserts success.
    #[track_caller]
    pub fn succeed(&self, line: &str) -> Run {
        let run = self.run(line);
        assert_eq!(run.code, 0, "{line}: {}", run.stderr);
        run
    }

    /// The program's cache folder.
    pub fn cache(&self) -> PathBuf {
        self.cache.path().join("nephroid")
    }

    /// Sorted names of the files in a folder; empty if it does not exist.
    pub fn files(&self, folder: impl AsRef<Path>) -> Vec<String> {
        names(&self.folder.path().join(folder))
    }

    pub fn manifest(&self, folder: &str) -> Value {
        read_json(&self.path(folder).join("manifest.json"))
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().expect("it ended by itself"),
            stdout: String::from_utf8(output.stdout).expect("text"),
            stderr: String::from_utf8(output.stderr).expect("text"),
        }
    }
}

impl Run {
    /// Parses stdout as one JSON document.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}", self.stdout))
    }

    /// Asserts the exit code, empty stdout, and one sentence on stderr that contains all these words.
    #[track_caller]
    pub fn failed_in_one_sentence(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, code, "{}", self.stderr);
        assert_eq!(self.stdout, "");
        let lines: Vec<&str> = self.stderr.lines().collect();
        let [sentence] = lines[..] else {
            panic!("not one line: {}", self.stderr)
        };
        // `error: location: what; remedy`
        assert!(sentence.starts_with("error: "), "{sentence}");
        assert!(sentence.contains(": ") && sentence.contains("; "), "{sentence}");
        for word in words {
            assert!(sentence.contains(word), "no {word:?} in: {sentence}");
        }
    }
}

pub fn read_json(path: &Path) -> Value {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&bytes).expect("JSON")
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Sorted names in a folder; empty if it does not exist.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("it can be listed").file_name();
    let mut names: Vec<String> = entries
        .map(|entry| name(entry).to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
